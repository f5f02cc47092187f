// Entropy against coded bits, as CSV: of RLPCA with 20 clusters, 20 components and the usual bits, section by
// section, and of sources without memory through the range coder alone. Behind
// docs/reproduction/entropy.csv.
//
// An entropy here is empirical and of order zero: the levels' own histogram, told to the decoder for nothing.
// matrix_bits has one histogram for each matrix of a cluster (of frames: for each series), component_bits one
// for each component, difference_bits one for each component's differences of order 1 or 2, whichever is
// less: along time of coefficients and frames, in the coder's order of vertices of basis vectors. For sources
// without memory, source_bits is what their distribution promises.
//
// Usage: batchenc_entropy_table CLIP.h5…

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "codecs/clip_codec.h"
#include "codecs/rlpca_clusters.h"
#include "codecs/seed_triangle_path.h"
#include "io/source_clip.h"
#include "kernels/range_coder.h"
#include "pipeline/blas_guard.h"
#include "pipeline/threads.h"

namespace batchenc {
namespace {

using Levels = std::span<const std::int32_t>;

/// Bits of all values by their own histogram.
double entropy_bits(Levels levels) {
    std::map<std::int32_t, std::int64_t> counts;
    for (const std::int32_t level : levels) ++counts[level];
    double bits = 0.0;
    for (const auto& [level, count] : counts)
        bits -= static_cast<double>(count) *
                std::log2(static_cast<double>(count) / static_cast<double>(levels.size()));
    return bits;
}

/// The same of differences from what lies `stride` values before, of the order that takes less.
double difference_entropy_bits(Levels levels, std::size_t stride) {
    std::vector<std::int32_t> differences(levels.begin(), levels.end());
    double least = std::numeric_limits<double>::infinity();
    for (int order = 1; order <= 2; ++order) {
        for (std::size_t k = differences.size(); k-- > stride;) differences[k] -= differences[k - stride];
        least = std::min(least, entropy_bits(differences));
    }
    return least;
}

struct Row {
    std::size_t levels = 0;
    double matrix_bits = 0.0, component_bits = 0.0, difference_bits = 0.0, source_bits = 0.0,
           coded_bits = 0.0;

    /// Adds a matrix of components one after another.
    void add(Levels matrix, std::int64_t components, std::size_t stride) {
        levels += matrix.size();
        matrix_bits += entropy_bits(matrix);
        for (std::int64_t c = 0; c < components; ++c) {
            const std::size_t size = matrix.size() / static_cast<std::size_t>(components);
            const Levels component = matrix.subspan(static_cast<std::size_t>(c) * size, size);
            component_bits += entropy_bits(component);
            difference_bits += difference_entropy_bits(component, stride);
        }
    }
    void print(const std::string& source, const std::string& section) const {
        std::printf("%s,%s,%zu,%.0f,%.0f,%.0f,%.0f,%.0f\n", source.c_str(), section.c_str(), levels,
                    matrix_bits, component_bits, difference_bits, source_bits, coded_bits);
        std::fflush(stdout);
    }
};

Expected<void> print_clip(const std::string& path) {
    const auto clip = read_mesh_sequence(path);
    if (!clip) return tl::unexpected(clip.error());
    const SerialExecutor executor;
    const CodecParameters parameters;
    const MeshTopology mesh(clip->triangles, clip->vertex_count);
    const auto segmentation = segment_clip(clip->view(), clip->triangles, {.clusters = 20}, executor);
    if (!segmentation) return tl::unexpected(segmentation.error());
    const auto source = RlpcaSource::of(clip->view(), mesh, *segmentation, parameters, executor);
    if (!source) return tl::unexpected(source.error());
    const RlpcaHeader& header = source->header();

    Row basis, coefficients, frames;
    std::vector<CodedCluster> coded;
    for (std::int32_t i = 0; i < header.cluster_count; ++i) {
        const ColMajorMatrixXf matrix = source->local_coordinates(static_cast<std::size_t>(i));
        auto components = principal_components(matrix, header.components);
        if (!components) return tl::unexpected(components.error());
        auto cluster = quantize_cluster(matrix, std::move(*components), header);
        if (!cluster) return tl::unexpected(cluster.error());
        basis.add(cluster->basis, cluster->component_count, 3);
        coefficients.add(cluster->coefficients, cluster->component_count, 1);
        const auto triangle = segmentation->seed_triangles[static_cast<std::size_t>(i)];
        for (const auto& series : SeedTrianglePath::of(clip->view(), triangle, header.lattice).series)
            frames.add(series, 1, 1);
        coded.push_back(std::move(*cluster));
    }
    const auto bitstream = source->write(CodecMethod::kRlpca, header.components, coded, executor);
    const auto info = read_clip_info(bitstream);
    if (!info) return tl::unexpected(info.error());
    const auto bits = [](std::int64_t bytes) { return 8.0 * static_cast<double>(bytes); };
    basis.coded_bits = bits(info->section_bytes.basis);
    coefficients.coded_bits = bits(info->section_bytes.coefficients);
    frames.coded_bits = bits(info->section_bytes.frames);
    const std::string name = std::filesystem::path(path).stem().string();
    basis.print(name, "basis");
    coefficients.print(name, "coefficients");
    frames.print(name, "frames");
    return {};
}

/// Values with the probabilities given, first of `lowest`, drawn alike on every machine.
void print_source(const std::string& name, std::int32_t lowest, const std::vector<double>& weights) {
    constexpr std::size_t kValues = 1 << 16;
    double sum = 0.0, bits_a_value = 0.0;
    for (const double weight : weights) sum += weight;
    for (const double weight : weights) {
        const double share = weight / sum;
        if (share > 0.0) bits_a_value -= share * std::log2(share);
    }
    std::vector<double> up_to;
    double running = 0.0;
    for (const double weight : weights) up_to.push_back(running += weight / sum);
    std::mt19937_64 generator(1);
    std::vector<std::int32_t> values;
    for (std::size_t k = 0; k < kValues; ++k) {
        const double draw = static_cast<double>(generator() >> 11) * 0x1p-53;
        const auto at = std::upper_bound(up_to.begin(), up_to.end() - 1, draw) - up_to.begin();
        values.push_back(lowest + static_cast<std::int32_t>(at));
    }
    Row row;
    row.add(values, 1, 1);
    row.source_bits = bits_a_value * static_cast<double>(kValues);
    RangeEncoder encoder;
    IntegerModel model;
    for (const std::int32_t value : values) encoder.encode(model, value);
    row.coded_bits = 8.0 * static_cast<double>(encoder.finish().size());
    row.print("iid", name);
}

void print_sources() {
    for (const double mean : {0.05, 0.5, 5.0, 50.0, 500.0}) {
        // Two-sided geometric of this mean magnitude m: 2q / (1 - q²) = m.
        const double q = (std::sqrt(1.0 + mean * mean) - 1.0) / mean;
        constexpr std::int32_t kLargest = 20000;
        std::vector<double> weights;
        for (std::int32_t value = -kLargest; value <= kLargest; ++value)
            weights.push_back(std::pow(q, std::abs(value)));
        char name[32];
        std::snprintf(name, sizeof name, "geometric %g", mean);
        print_source(name, -kLargest, weights);
    }
    for (const std::int32_t count : {1, 2, 15, 64, 1024})
        print_source("uniform " + std::to_string(count), -count / 2,
                     std::vector<double>(static_cast<std::size_t>(count), 1.0));
    print_source("coin 0.01", 0, {0.99, 0.01});
}

}  // namespace
}  // namespace batchenc

int main(int argc, char** argv) {
    using namespace batchenc;
    const auto blas = guard_blas(argv);
    Expected<void> done;
    if (!blas) done = tl::unexpected(blas.error());
    std::printf("source,section,levels,matrix_bits,component_bits,difference_bits,source_bits,coded_bits\n");
    for (int i = 1; done && i < argc; ++i) run_with_threads(1, [&] { done = print_clip(argv[i]); });
    if (done) {
        print_sources();
        return 0;
    }
    std::fprintf(stderr, "%s\n", done.error().to_string().c_str());
    return 1;
}
