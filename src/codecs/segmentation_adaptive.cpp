#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "codecs/segmentation_methods.h"
#include "kernels/deviation_column.h"
#include "kernels/seeds.h"

namespace batchenc {
namespace {

// Of a number of clusters asked for, these begin with farthest-point seeds, the others are grown. The thesis
// starts from one or two; on the classic clips three quarters gave the same deviation, and clusters of a size
// that PCA makes more of (docs/SEGMENTATION.md).
constexpr double kInitialShare = 0.75;
constexpr std::int32_t kPatience = 12;  // clusters to go on after the modelled bits were lowest
constexpr int kRounds = 3;              // of merging, dissolving and growing again
constexpr std::size_t kCandidates = 8;  // vertices of a cluster that are tried as its seed at the end
constexpr std::size_t kWitnesses = 32;  // vertices of a cluster that judge them
constexpr float kNoLimit = std::numeric_limits<float>::infinity();

/// A cluster, or a seed that may become one.
struct Cluster {
    std::int32_t seed = 0;
    SeedTriangle triangle;
    DeviationColumn theta;
};

/// What a cluster is like just now.
struct Standing {
    double sum = 0.0;         // of theta, over its vertices that are no corners of seed triangles
    std::int64_t count = 0;   // of these vertices
    std::int32_t worst = -1;  // of these the one of largest theta that may become a seed
    double average() const { return count > 0 ? sum / static_cast<double>(count) : 0.0; }
};

class Adaptive {
 public:
    Adaptive(const SegmentationInput& input, const VertexBlocks& blocks)
        : input_(input),
          blocks_(blocks),
          vertex_count_(static_cast<std::size_t>(input.positions.vertex_count())),
          step_(input.e_max / 4096.0),
          labels_(vertex_count_, -1),
          limits_(static_cast<std::size_t>(blocks.count() * kVertexBlock), -1.0f),
          refused_(vertex_count_, false) {}

    Segmentation run(GrowthLimits limits) {
        // More clusters than this cannot all have more than a handful of vertices.
        const auto most = static_cast<std::int32_t>(vertex_count_ / (kFewVertices + 1));
        limits.count = std::min(limits.count, std::max(most, 1));
        // Where the number is to be found, growth begins with one.
        const double share = limits.average_deviation < 0.0 ? kInitialShare : 0.0;
        const auto initial = static_cast<std::int32_t>(share * static_cast<double>(limits.count));
        for (const std::int32_t seed :
             farthest_point_seeds(input_.positions.frames(0, 1), std::max(1, initial)))
            clusters_.push_back(make_cluster(seed));
        for_each_block([&](std::int64_t block) { find_clusters(block); });
        for (std::size_t i = 0; i < clusters_.size(); ++i)
            pin(clusters_[i].triangle.vertices, static_cast<std::int32_t>(i));
        std::int32_t count = limits.count;
        if (count == 0) {
            count = grow_while_bits_fall(limits);
            std::vector<bool> goes(clusters_.size(), false);
            std::fill(goes.begin() + count, goes.end(), true);
            remove(goes);
        } else {
            grow(count, limits);
        }
        for (int round = 0; round < kRounds && tidy(); ++round) grow(count, limits);
        move_seeds();
        return finish();
    }

 private:
    /// A corner of a seed triangle belongs to its cluster for good.
    bool is_pinned(std::size_t v) const { return limits_[v] < 0.0f; }

    /// Calls function(block) for every block, some at once.
    template <typename Function>
    void for_each_block(const Function& function) const {
        constexpr std::int64_t kBlocksATask = 16;
        input_.executor.for_each((blocks_.count() + kBlocksATask - 1) / kBlocksATask, [&](std::int64_t task) {
            const std::int64_t end = std::min((task + 1) * kBlocksATask, blocks_.count());
            for (std::int64_t block = task * kBlocksATask; block < end; ++block) function(block);
        });
    }

    Cluster make_cluster(std::int32_t seed) {
        const SeedTriangle triangle = input_.seed_triangles.choose(seed, input_.executor);
        return {seed, triangle,
                DeviationColumn(blocks_, triangle_track(input_.positions, triangle.vertices))};
    }

    /// Its column of theta, as far as it takes to see which vertices it would gather; how many these are.
    std::int64_t measure(Cluster& cluster) {
        std::vector<std::int64_t> gathered(static_cast<std::size_t>(blocks_.count()), 0);
        for_each_block([&](std::int64_t block) {
            const float* limits = limits_.data() + block * kVertexBlock;
            cluster.theta.extend(block, limits);
            for (std::int64_t v = 0; v < kVertexBlock; ++v)
                gathered[static_cast<std::size_t>(block)] += cluster.theta.block(block)[v] < limits[v];
        });
        std::int64_t count = 0;
        for (const std::int64_t of_block : gathered) count += of_block;
        for (const std::int32_t corner : cluster.triangle.vertices) {
            const auto v = static_cast<std::size_t>(corner);
            count += 1 - (cluster.theta[v] < limits_[v]);  // corners come along whatever their theta is
        }
        return count;
    }

    /// Adds a measured cluster.
    void add(Cluster cluster) {
        const auto label = static_cast<std::int32_t>(clusters_.size());
        clusters_.push_back(std::move(cluster));
        const Cluster& added = clusters_.back();
        for (std::size_t v = 0; v < vertex_count_; ++v) {
            if (!(added.theta[v] < limits_[v])) continue;
            limits_[v] = added.theta[v];
            labels_[v] = label;
        }
        pin(added.triangle.vertices, label);
    }

    void pin(const Triangle& triangle, std::int32_t label) {
        for (const std::int32_t corner : triangle) {
            const auto v = static_cast<std::size_t>(corner);
            if (!is_pinned(v)) labels_[v] = label;
            limits_[v] = -1.0f;
        }
    }

    std::vector<Standing> standings() const {
        std::vector<Standing> all(clusters_.size());
        for (std::size_t v = 0; v < vertex_count_; ++v) {
            if (is_pinned(v)) continue;
            Standing& own = all[static_cast<std::size_t>(labels_[v])];
            own.sum += static_cast<double>(limits_[v]);
            ++own.count;
            if (limits_[v] > 0.0f &&
                (own.worst < 0 || limits_[v] > limits_[static_cast<std::size_t>(own.worst)]) && !refused_[v])
                own.worst = static_cast<std::int32_t>(v);
        }
        return all;
    }

    double average_deviation(const std::vector<Standing>& all) const {
        double sum = 0.0;
        for (const Standing& standing : all) sum += standing.average();
        return sum / static_cast<double>(all.size()) / static_cast<double>(blocks_.frame_count());
    }

    /// Adds clusters up to a count, each seeded by the worst vertex (4.4) of the worst cluster (4.3); ends
    /// earlier where the deviation is small enough or no vertex is left that could seed one.
    void grow(std::int32_t count, const GrowthLimits& limits) {
        // Ends: each turn adds a cluster or refuses a vertex, and a refused one is offered no more.
        while (static_cast<std::int32_t>(clusters_.size()) < count) {
            const std::vector<Standing> all = standings();
            if (average_deviation(all) <= limits.average_deviation) return;
            std::int32_t seed = -1;
            double worst = -1.0;
            for (const Standing& standing : all) {
                if (standing.worst < 0 || !(standing.average() > worst)) continue;
                worst = standing.average();
                seed = standing.worst;
            }
            if (seed < 0) return;
            Cluster cluster = make_cluster(seed);
            if (measure(cluster) > kFewVertices)
                add(std::move(cluster));
            else
                refused_[static_cast<std::size_t>(seed)] = true;
        }
    }

    /// Modelled bits of a value of this size, coded in steps of step_.
    double bits_of(double value) const {
        return step_ > 0.0 ? 0.5 * std::log2(1.0 + (value / step_) * (value / step_)) : 0.0;
    }

    /// Modelled bits of a seed triangle: nine coordinates over time by their second differences.
    double carrying_bits(const Triangle& triangle) const {
        double bits = 0.0;
        for (const std::int32_t v : triangle) {
            for (int axis = 0; axis < 3; ++axis) {
                for (std::int64_t f = 0; f < input_.positions.frame_count(); ++f) {
                    const auto before = [&](std::int64_t frames) {
                        return static_cast<double>(
                            input_.positions.at(std::max<std::int64_t>(f - frames, 0), v)[axis]);
                    };
                    bits += bits_of(before(0) - 2.0 * before(1) + before(2));
                }
            }
        }
        return bits;
    }

    /// Modelled bits of stepping every vertex from frame to frame by its theta.
    double stepping_bits() const {
        const double values = 3.0 * static_cast<double>(blocks_.frame_count());
        double bits = 0.0;
        for (std::size_t v = 0; v < vertex_count_; ++v) {
            if (!is_pinned(v)) bits += values * bits_of(std::sqrt(static_cast<double>(limits_[v]) / values));
        }
        return bits;
    }

    /// Grows until the modelled bits have not fallen for a while; returns where they were lowest.
    std::int32_t grow_while_bits_fall(const GrowthLimits& limits) {
        double carrying = carrying_bits(clusters_[0].triangle.vertices);
        double best_bits = carrying + stepping_bits();
        std::int32_t best_count = 1;
        for (std::int32_t count = 1; count - best_count < kPatience && count < kMostAutomaticClusters;
             ++count) {
            grow(count + 1, limits);
            if (static_cast<std::int32_t>(clusters_.size()) == count) break;
            carrying += carrying_bits(clusters_.back().triangle.vertices);
            const double bits = carrying + stepping_bits();
            if (bits < best_bits) {
                best_bits = bits;
                best_count = count + 1;
            }
        }
        return best_count;
    }

    /// Removes clusters, not all of them; their vertices go where their theta is smallest among the others.
    void remove(const std::vector<bool>& goes) {
        std::vector<std::int32_t> new_label(clusters_.size(), -1);
        std::size_t kept = 0;
        for (std::size_t i = 0; i < clusters_.size(); ++i) {
            if (goes[i]) continue;
            new_label[i] = static_cast<std::int32_t>(kept);
            if (kept != i) clusters_[kept] = std::move(clusters_[i]);
            ++kept;
        }
        clusters_.erase(clusters_.begin() + static_cast<std::ptrdiff_t>(kept), clusters_.end());
        std::vector<std::int64_t> open;  // blocks that hold vertices without a cluster
        for (std::size_t v = 0; v < vertex_count_; ++v) {
            labels_[v] = new_label[static_cast<std::size_t>(labels_[v])];
            if (labels_[v] >= 0) continue;
            const auto b = static_cast<std::int64_t>(v) / kVertexBlock;
            if (open.empty() || open.back() != b) open.push_back(b);
        }
        input_.executor.for_each(static_cast<std::int64_t>(open.size()),
                                 [&](std::int64_t k) { find_clusters(open[static_cast<std::size_t>(k)]); });
        // A corner that had belonged to a removed cluster first may be one of a kept cluster, too.
        for (std::size_t i = 0; i < clusters_.size(); ++i)
            pin(clusters_[i].triangle.vertices, static_cast<std::int32_t>(i));
    }

    /// The cluster of smallest theta for those vertices of a block that have none.
    void find_clusters(std::int64_t block) {
        const auto first = static_cast<std::size_t>(block * kVertexBlock);
        const std::size_t count = std::min<std::size_t>(kVertexBlock, vertex_count_ - first);
        float limits[kVertexBlock];
        std::fill(std::begin(limits), std::end(limits), -1.0f);
        for (std::size_t v = 0; v < count; ++v) {
            if (labels_[first + v] < 0) limits[v] = kNoLimit;
        }
        const std::vector<std::int32_t> clusters = nearest_first(block);
        for (const std::int32_t i : clusters) {
            DeviationColumn& theta = clusters_[static_cast<std::size_t>(i)].theta;
            theta.extend(block, limits);
            for (std::size_t v = 0; v < count; ++v) {
                if (!(theta[first + v] < limits[v])) continue;
                limits[v] = limits_[first + v] = theta[first + v];
                labels_[first + v] = i;
            }
        }
        // Coordinates whose squares float32 does not hold are infinitely bad everywhere.
        for (std::size_t v = 0; v < count; ++v) {
            if (labels_[first + v] >= 0) continue;
            labels_[first + v] = clusters[0];
            limits_[first + v] = kLargestDeviation;
        }
    }

    /// Clusters by the distance of their seeds from a block's first vertex: what comes first is likely to be
    /// the right one, and spares most of the work on those that follow.
    std::vector<std::int32_t> nearest_first(std::int64_t block) const {
        std::vector<std::pair<double, std::int32_t>> order;
        for (const Cluster& cluster : clusters_) {
            order.emplace_back(squared_distance(input_.positions.at(0, block * kVertexBlock),
                                                input_.positions.at(0, cluster.seed)),
                               static_cast<std::int32_t>(order.size()));
        }
        std::sort(order.begin(), order.end());
        std::vector<std::int32_t> clusters;
        for (const auto& [distance, cluster] : order) clusters.push_back(cluster);
        return clusters;
    }

    /// Dissolves clusters of too few vertices, and one of each pair that is better as one (4.6); whether
    /// there were any.
    bool tidy() {
        std::vector<bool> goes(clusters_.size(), false);
        mark_mergers(goes);
        std::vector<std::int64_t> sizes(clusters_.size(), 0);
        for (const std::int32_t label : labels_) ++sizes[static_cast<std::size_t>(label)];
        for (std::size_t i = 0; i < sizes.size(); ++i) goes[i] = goes[i] || sizes[i] <= kFewVertices;
        if (std::find(goes.begin(), goes.end(), false) == goes.end()) goes[0] = false;
        bool any = false;
        for (std::size_t i = 0; i < goes.size(); ++i) {
            if (goes[i]) refused_[static_cast<std::size_t>(clusters_[i].seed)] = any = true;
        }
        if (any) remove(goes);
        return any;
    }

    /// Marks each cluster that another one can absorb so that both together have less average deviation, in
    /// the LCF of the absorbing one, than either had. Since every vertex is where its theta is smallest,
    /// only small clusters have that chance, of which the corners, that do not count, are a large part.
    void mark_mergers(std::vector<bool>& goes) {
        const std::vector<Standing> all = standings();
        std::vector<std::vector<std::int32_t>> members(clusters_.size());
        std::vector<bool> involved(clusters_.size(), false);
        for (std::size_t j = 0; j < clusters_.size(); ++j) {
            for (std::size_t i = 0; i < clusters_.size() && !involved[j]; ++i) {
                if (i == j || involved[i] || all[i].count == 0 || all[j].count == 0) continue;
                const double bound = std::min(all[i].average(), all[j].average());
                const double count = static_cast<double>(all[i].count + all[j].count + 3);
                if (!((all[i].sum + all[j].sum) / count < bound)) continue;
                if (members[j].empty()) members[j] = members_of(static_cast<std::int32_t>(j));
                if (!is_sum_below(clusters_[i], members[j], bound * count - all[i].sum)) continue;
                goes[j] = involved[i] = involved[j] = true;
            }
        }
    }

    std::vector<std::int32_t> members_of(std::int32_t label) const {
        std::vector<std::int32_t> members;
        for (std::size_t v = 0; v < vertex_count_; ++v) {
            if (labels_[v] == label) members.push_back(static_cast<std::int32_t>(v));
        }
        return members;
    }

    /// Whether the sum of theta over some vertices in the LCF of a cluster is below a bound. What is known of
    /// the column decides nearly always; more of it is computed only where it does not.
    static bool is_sum_below(Cluster& cluster, const std::vector<std::int32_t>& vertices, double bound) {
        const auto theta = [&](std::int32_t v) {
            return static_cast<double>(cluster.theta[static_cast<std::size_t>(v)]);
        };
        double sum = 0.0;
        for (const std::int32_t v : vertices) sum += theta(v);
        float limits[kVertexBlock];
        std::fill(std::begin(limits), std::end(limits), kNoLimit);
        for (const std::int32_t v : vertices) {
            if (!(sum < bound)) return false;
            if (cluster.theta.is_complete(v / kVertexBlock)) continue;
            cluster.theta.extend(v / kVertexBlock, limits);
            sum = 0.0;
            for (const std::int32_t w : vertices) sum += theta(w);
        }
        return sum < bound;
    }

    /// Moves each seed to the vertex, of some in its cluster, in whose LCF the cluster deviates least.
    void move_seeds() {
        std::vector<std::vector<std::int32_t>> members(clusters_.size());
        for (std::size_t v = 0; v < vertex_count_; ++v)
            members[static_cast<std::size_t>(labels_[v])].push_back(static_cast<std::int32_t>(v));
        input_.executor.for_each(static_cast<std::int64_t>(clusters_.size()), [&](std::int64_t i) {
            move_seed(clusters_[static_cast<std::size_t>(i)], static_cast<std::int32_t>(i),
                      members[static_cast<std::size_t>(i)]);
        });
    }

    void move_seed(Cluster& cluster, std::int32_t label, const std::vector<std::int32_t>& members) const {
        std::vector<std::int32_t> seeds = {cluster.seed};
        std::vector<Triangle> triangles = {cluster.triangle.vertices};
        for (const std::int32_t v : spread_sample(members, kCandidates)) {
            const auto triangle = input_.seed_triangles.incident_triangle(v);
            if (!triangle) continue;
            const bool inside = std::all_of(triangle->begin(), triangle->end(), [&](std::int32_t corner) {
                return labels_[static_cast<std::size_t>(corner)] == label;
            });
            if (!inside) continue;
            seeds.push_back(v);
            triangles.push_back(*triangle);
        }
        std::vector<LocalFrameTrack> tracks;
        for (const Triangle& t : triangles) tracks.push_back(triangle_track(input_.positions, t));
        static_assert(kWitnesses <= kVertexBlock);
        const std::vector<std::int32_t> witnesses = spread_sample(members, kWitnesses);
        AlignedFloats block(vertex_block_size(blocks_.frame_count()));
        gather_vertex_block(input_.positions, witnesses, block.data());
        std::vector<float> theta(tracks.size() * kVertexBlock);
        deviation_block(block.data(), blocks_.frame_count(), tracks, theta);
        std::vector<double> sums(tracks.size(), 0.0);
        for (std::size_t k = 0; k < sums.size(); ++k) {
            for (std::size_t v = 0; v < witnesses.size(); ++v)
                sums[k] += static_cast<double>(theta[k * kVertexBlock + v]);
        }
        const auto best = static_cast<std::size_t>(std::min_element(sums.begin(), sums.end()) - sums.begin());
        if (best == 0) return;
        cluster.seed = seeds[best];
        cluster.triangle = {.vertices = triangles[best]};
    }

    Segmentation finish() const {
        Segmentation segmentation;
        const auto count = static_cast<std::int32_t>(clusters_.size());
        segmentation.labels = labels_;
        for (std::int32_t i = 0; i < count; ++i) {
            const Cluster& cluster = clusters_[static_cast<std::size_t>(i)];
            segmentation.seed_triangles.push_back(cluster.triangle.vertices);
            std::string note = seed_triangle_note(i, cluster.seed, cluster.triangle);
            if (!note.empty()) segmentation.notes.push_back(std::move(note));
        }
        return segmentation;
    }

    const SegmentationInput& input_;
    const VertexBlocks& blocks_;
    std::size_t vertex_count_;
    double step_;  // of the modelled quantisers
    std::vector<Cluster> clusters_;
    std::vector<std::int32_t> labels_;  // V
    std::vector<float>
        limits_;  // V and the rest of the last block: theta in the own cluster; -1: pinned, none
    std::vector<bool> refused_;  // V: as a seed gathered no more than a handful
};

}  // namespace

Segmentation segment_adaptively(const SegmentationInput& input, const VertexBlocks& blocks,
                                const GrowthLimits& limits) {
    Segmentation segmentation = Adaptive(input, blocks).run(limits);
    claim_seed_vertices(segmentation);  // seeds have moved since they pinned their corners
    measure_deviations(input, &blocks, segmentation);
    return segmentation;
}

}  // namespace batchenc
