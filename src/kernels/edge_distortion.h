#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/executor.h"
#include "core/mesh_sequence.h"

namespace batchenc {

/// How far a decoded sequence distorts the edges of its source, in space and along time; dimensionless.
struct EdgeDistortion {
    double space = 0.0;  ///< mean local deviation of edges' relative length differences
    double time = 0.0;   ///< mean relative length difference of the vertices' steps in time
    double total = 0.0;  ///< sqrt(space² + (c · time)²)
};

/// Measures EdgeDistortion over consecutive runs of frames of one sequence. It is STED-like: the idea is that
/// of L. Váša and V. Skala, "A perception correlated comparison method for dynamic meshes" (IEEE TVCG 17(2),
/// 2011), the weight c theirs; its other constants and the window are set here, so that figures compare with
/// each other and not with those of that paper or of others.
///
/// Let p(v, f) be the source's positions and p̂ the decoded ones, 0 ≤ v < V, 0 ≤ f < F, and E the edges: pairs
/// of different vertices that a triangle joins, each once however many triangles have it.
///
///   l(e, f) = |p(a, f) - p(b, f)| of edge e = {a, b}, l̂ likewise;   d(e, f) = |l̂ - l| / l
///   m(v, f) = Σ l d / Σ l,   s(v, f) = sqrt(Σ l (d - m)² / Σ l)     sums over the edges at v with l > 0
///   space = mean of s over all frames and all vertices that have an edge
///
///   t(v, f) = sqrt(|p(v, f) - p(v, f - 1)|² + τ²), t̂ likewise;      τ = kTimeStep · D,  f ≥ 1
///   T(v, f) = mean of t(v, g) over g = max(1, f - kWindow + 1) … f
///   time = mean of |t̂(v, f) - t(v, f)| / T(v, f) over f = 1 … F - 1 and all V vertices
///
/// D is the diagonal of the bounding box of the source's first frame. An edge without length in a frame of
/// the source is left out of that frame; a vertex with no other edges adds s = 0. Where T is 0 (only if D is)
/// the term is 0. Without edges, space is 0; with one frame or no vertices, time is.
///
/// So a decoded clip that is the source moved rigidly, differently in every frame, has space = 0, and one
/// that is the source scaled about a point; one that is the source shifted, for all frames alike, has time =
/// 0.
///
/// Bounded memory: 72 bytes a vertex, 8 an edge, and while a run is added 16 a frame and block of 2048
/// vertices. Sums are double precision in an order that neither the executor nor the runs change.
class EdgeDistortionMeter {
 public:
    static constexpr double kTimeWeight = 0.136;  ///< c
    static constexpr double kTimeStep = 0.001;    ///< length that a step in time has at rest, over D
    static constexpr std::int64_t kWindow = 10;   ///< steps in time that a vertex' speed is taken over

    /// triangles: every index in [0, vertex_count), T below 2^31 / 6.
    EdgeDistortionMeter(std::span<const Triangle> triangles, std::int64_t vertex_count);

    /// Adds the next frames. source and decoded have the same shape, V as constructed.
    void add(PositionsView source, PositionsView decoded, const Executor& executor);

    /// Of all frames added so far.
    EdgeDistortion finish() const;

 private:
    /// What a block of vertices adds to a frame.
    struct Partial {
        double deviation = 0.0;  // s, summed
        double step = 0.0;       // relative differences of steps in time, summed
    };
    /// A run of frames that is being added, and the number of its first one in the sequence.
    struct Run {
        PositionsView source, decoded;
        std::int64_t first_frame;
    };
    void measure_block(const Run& run, std::int64_t block);
    double local_deviation(const float* source, const float* decoded, std::int64_t vertex) const;
    double step_difference(const Run& run, std::int64_t frame, std::int64_t vertex);

    std::int64_t vertex_count_;
    std::int64_t block_count_;
    std::int64_t vertices_with_edges_ = 0;
    std::vector<std::int32_t> first_;       // V + 1: where a vertex' neighbours start
    std::vector<std::int32_t> neighbours_;  // both ends of every edge, ascending at a vertex
    double rest_step_ = 0.0;                // τ
    std::int64_t frame_count_ = 0;
    std::vector<float> last_source_, last_decoded_;  // 3 V: of the frame added last
    std::vector<float> steps_;                       // kWindow × V: t of the last steps, in turns
    std::vector<Partial> partials_;                  // of the run being added: [frame][block]
    Partial sum_;
};

}  // namespace batchenc
