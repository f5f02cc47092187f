#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

struct XXH3_state_s;

namespace batchenc {

/// What a result may hold, each kind with one stored type: little-endian, IEEE, strings of fixed length.
enum class ContentKind : char {
    kGroup = 'g',
    kUint8 = 'b',
    kInt32 = 'i',
    kInt64 = 'l',
    kFloat32 = 'f',
    kFloat64 = 'd',
    kString = 's',
};

/// The 128-bit hash of one object or attribute: of its kind, its rank (0 scalar, 1 array) and extent, and its
/// bytes as stored.
class ContentHash {
 public:
    using Bytes = std::array<std::uint8_t, 16>;

    /// A scalar attribute or a group.
    explicit ContentHash(ContentKind kind);
    /// A one-dimensional dataset.
    ContentHash(ContentKind kind, std::int64_t extent);
    ~ContentHash();
    ContentHash(ContentHash&&) noexcept;

    ContentHash& update(const void* bytes, std::size_t size);
    Bytes finish() const;

 private:
    void begin(ContentKind kind, std::uint8_t rank, std::int64_t extent);

    struct Release {
        void operator()(XXH3_state_s* state) const;
    };
    std::unique_ptr<XXH3_state_s, Release> state_;
};

/// The digest of a result: XXH3-128 over all its objects and attributes but the digest itself, in the
/// bytewise order of their keys. Keys: "/clips/000000/bitstream" an object, "/clips/000000@first_frame" an
/// attribute,
/// "/@method" one of the root, which is no object of its own. docs/RESULTS.md specifies the bytes.
///
/// It finds accidents, not forgers: whoever rewrites the content can rewrite the digest.
class ResultDigest {
 public:
    /// Whether the key was new.
    bool add(const std::string& key, const ContentHash& hash);
    /// 32 lower-case hexadecimal digits.
    std::string hex() const;

    static std::string attribute_key(std::string_view object, std::string_view attribute) {
        return std::string(object) + "@" + std::string(attribute);
    }

 private:
    std::map<std::string, ContentHash::Bytes> entries_;
};

}  // namespace batchenc
