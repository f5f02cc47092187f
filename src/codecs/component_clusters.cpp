#include "codecs/component_clusters.h"

#include <cmath>
#include <string>

#include "codecs/coded_streams.h"
#include "codecs/integer_contexts.h"
#include "kernels/byte_stream.h"
#include "kernels/quantizer.h"

namespace batchenc {
namespace {

Expected<MinMaxQuantizer> read_quantizer(ByteReader& reader, int bits) {
    const auto low = reader.get<float>();
    const auto step = reader.get<float>();
    if (!low || !step) return fail(ErrorCode::kCorrupt, "the table of quantisers ends too early");
    const MinMaxQuantizer quantizer{*low, *step};
    const bool finite = std::isfinite(*low) && std::isfinite(*step) &&
                        std::isfinite(quantizer.dequantize(std::int32_t{1} << bits));
    if (!finite || *step < 0.0f) return fail(ErrorCode::kCorrupt, "a quantiser is not finite");
    return quantizer;
}

/// Turns levels relative to zero into values. False for a level outside the scale.
template <typename Store>
bool dequantize_levels(std::span<const std::int32_t> levels, const MinMaxQuantizer& quantizer, int bits,
                       Store store) {
    const std::int32_t zero = quantizer.zero_level(bits);
    const auto top = std::uint32_t{1} << bits;
    bool good = true;
    for (std::size_t k = 0; k < levels.size(); ++k) {
        const std::uint32_t level = static_cast<std::uint32_t>(levels[k]) + static_cast<std::uint32_t>(zero);
        good &= level <= top;
        store(k, quantizer.dequantize(static_cast<std::int32_t>(level)));
    }
    return good;
}

/// Weights of fitted predictions, component by component.
Expected<void> read_weights(ByteReader& reader, const SeriesForm& form, std::int64_t components,
                            std::vector<float>& weights) {
    for (std::int64_t k = 0; k < components * form.fitted; ++k) {
        const auto weight = reader.get<float>();
        if (!weight) return tl::unexpected(weight.error());
        if (!std::isfinite(*weight)) return fail(ErrorCode::kCorrupt, "a weight is not finite");
        weights.push_back(*weight);
    }
    return {};
}

}  // namespace

Expected<void> ComponentClusters::read_basis(std::span<const std::uint8_t> payload, std::int32_t components,
                                             std::int64_t size_limit_bytes, const Executor& executor) {
    ByteReader reader(payload);
    std::vector<MinMaxQuantizer> quantizers(size());
    std::vector<std::int64_t> values(size());
    std::int64_t largest = 0, total = 0;
    coded_components_.resize(size());
    used_components_.resize(size());
    for (std::size_t i = 0; i < size(); ++i) {
        const std::int64_t rows = 3 * clusters_[i].size();
        const auto count = reader.get_varint(static_cast<std::uint64_t>(
            std::min({static_cast<std::int64_t>(header_.components), rows, frame_count_})));
        if (!count) return tl::unexpected(count.error());
        coded_components_[i] = static_cast<std::int64_t>(*count);
        used_components_[i] =
            components < 0 ? coded_components_[i] : std::min<std::int64_t>(components, coded_components_[i]);
        values[i] = rows * coded_components_[i];
        largest = std::max(largest, used_components_[i]);
        total += rows * (given_ + used_components_[i]);
        if (*count == 0) continue;
        const auto quantizer = read_quantizer(reader, header_.basis_bits);
        if (!quantizer) return tl::unexpected(quantizer.error());
        quantizers[i] = *quantizer;
    }
    if (total > size_limit_bytes / 8)
        return fail(ErrorCode::kLimit, std::to_string(total) + " basis values need more memory than allowed");
    const auto streams = deal_streams(values);
    const auto parts = split_streams(reader, streams, values);
    if (!parts) return tl::unexpected(parts.error());
    bases_.resize(size());
    executor.for_each(static_cast<std::int64_t>(size()), [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        bases_[i] = PackedBasis(clusters_[i].size(), given_ + used_components_[i]);
    });
    return decode_streams(
        *parts, streams, components < 0, executor,
        [&](RangeDecoder& decoder, const std::vector<std::int32_t>& clusters) {
            ScaleContexts contexts;
            std::vector<std::int32_t> column;
            for (std::int64_t l = 0; l < largest; ++l) {
                for (const std::int32_t index : clusters) {
                    const auto i = static_cast<std::size_t>(index);
                    if (l >= used_components_[i]) continue;
                    if (!decode_column(decoder, contexts, clusters_[i], column)) return false;
                    float* packed = bases_[i].values.data() + bases_[i].index(0, given_ + l);
                    const std::int64_t skip = kPackedRows * (given_ + used_components_[i] - 1);
                    std::int64_t in_block = 0;
                    const bool good = dequantize_levels(
                        std::span(column).first(static_cast<std::size_t>(3 * clusters_[i].size())),
                        quantizers[i], header_.basis_bits, [&](std::size_t, float value) {
                            *packed++ = value;
                            if (++in_block == kPackedRows) {
                                in_block = 0;
                                packed += skip;
                            }
                        });
                    if (!good) return false;
                }
            }
            return true;
        });
}

Expected<void> ComponentClusters::read_coefficients(std::span<const std::uint8_t> payload,
                                                    const SeriesForm& form, std::int64_t size_limit_bytes,
                                                    const Executor& executor) {
    ByteReader reader(payload);
    std::vector<MinMaxQuantizer> quantizers(size());
    std::vector<std::int64_t> values(size());
    std::vector<std::vector<float>> weights(size());
    std::int64_t largest = 0, total = 0;
    for (std::size_t i = 0; i < size(); ++i) {
        values[i] = coded_components_[i] * frame_count_;
        largest = std::max(largest, used_components_[i]);
        total += (given_ + used_components_[i]) * stride();
        if (coded_components_[i] == 0) continue;
        const auto quantizer = read_quantizer(reader, header_.coefficient_bits);
        if (!quantizer) return tl::unexpected(quantizer.error());
        quantizers[i] = *quantizer;
        if (auto read = read_weights(reader, form, coded_components_[i], weights[i]); !read) return read;
    }
    if (total > size_limit_bytes / 8)
        return fail(ErrorCode::kLimit, std::to_string(total) + " coefficients need more memory than allowed");
    const auto streams = deal_streams(values);
    const auto parts = split_streams(reader, streams, values);
    if (!parts) return tl::unexpected(parts.error());
    coefficients_.resize(size());
    executor.for_each(static_cast<std::int64_t>(size()), [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        coefficients_[i].assign(static_cast<std::size_t>((given_ + used_components_[i]) * stride()), 0.0f);
    });
    return decode_streams(
        *parts, streams, used_components_ == coded_components_, executor,
        [&](RangeDecoder& decoder, const std::vector<std::int32_t>& clusters) {
            SeriesContexts contexts;
            std::vector<std::int32_t> series(static_cast<std::size_t>(frame_count_));
            for (std::int64_t l = 0; l < largest; ++l) {
                for (const std::int32_t index : clusters) {
                    const auto i = static_cast<std::size_t>(index);
                    if (l >= used_components_[i]) continue;
                    const bool good =
                        form.fitted == 0
                            ? decode_series(decoder, contexts, series)
                            : decode_fitted(decoder, contexts, form.weights_of(weights[i], l), series);
                    if (!good) return false;
                    float* row = coefficients_[i].data() + (given_ + l) * stride();
                    if (!dequantize_levels(series, quantizers[i], header_.coefficient_bits,
                                           [&](std::size_t f, float value) { row[f] = value; }))
                        return false;
                }
            }
            return true;
        });
}

void ComponentClusters::set_given(std::size_t cluster, std::int64_t component, std::span<const float> basis) {
    for (std::size_t row = 0; row < basis.size(); ++row)
        bases_[cluster].values[bases_[cluster].index(static_cast<std::int64_t>(row), component)] = basis[row];
    std::fill_n(coefficients_[cluster].begin() + component * stride(), frame_count_, 1.0f);
}

void ComponentClusters::reconstruct(std::size_t cluster, const LocalFrameTrack& track, std::int64_t begin,
                                    MutablePositionsView out) const {
    ClusterGeometry geometry;
    geometry.vertices = clusters_[cluster].vertices;
    geometry.basis = &bases_[cluster];
    geometry.coefficients = coefficients_[cluster].data();
    geometry.frame_track = track.values.data();
    geometry.stride = stride();
    reconstruct_cluster(geometry, begin, out.frame_count(), out.data(), 3 * out.vertex_count());
}

}  // namespace batchenc
