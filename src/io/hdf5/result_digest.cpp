#include "io/hdf5/result_digest.h"

#include <xxhash.h>

#include <bit>
#include <cstring>
#include <new>

namespace batchenc {

static_assert(std::endian::native == std::endian::little,
              "results store little-endian numbers, and are hashed and written as they stand in memory");

ContentHash::ContentHash(ContentKind kind) { begin(kind, 0, 0); }

ContentHash::ContentHash(ContentKind kind, std::int64_t extent) { begin(kind, 1, extent); }

ContentHash::~ContentHash() = default;

ContentHash::ContentHash(ContentHash&&) noexcept = default;

void ContentHash::Release::operator()(XXH3_state_s* state) const { XXH3_freeState(state); }

void ContentHash::begin(ContentKind kind, std::uint8_t rank, std::int64_t extent) {
    state_.reset(XXH3_createState());
    if (!state_) throw std::bad_alloc();
    XXH3_128bits_reset(state_.get());
    std::uint8_t prefix[10] = {static_cast<std::uint8_t>(kind), rank};
    std::memcpy(prefix + 2, &extent, sizeof(extent));
    update(prefix, sizeof(prefix));
}

ContentHash& ContentHash::update(const void* bytes, std::size_t size) {
    XXH3_128bits_update(state_.get(), bytes, size);
    return *this;
}

ContentHash::Bytes ContentHash::finish() const {
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits_digest(state_.get()));
    Bytes bytes;
    std::memcpy(bytes.data(), canonical.digest, bytes.size());
    return bytes;
}

bool ResultDigest::add(const std::string& key, const ContentHash& hash) {
    return entries_.emplace(key, hash.finish()).second;
}

std::string ResultDigest::hex() const {
    ContentHash all(ContentKind::kGroup);
    for (const auto& [key, hash] : entries_) {
        all.update(key.c_str(), key.size() + 1);  // with the terminator, so that no two lists run together
        all.update(hash.data(), hash.size());
    }
    std::string text;
    for (const std::uint8_t byte : all.finish()) {
        text += "0123456789abcdef"[byte >> 4];
        text += "0123456789abcdef"[byte & 15];
    }
    return text;
}

}  // namespace batchenc
