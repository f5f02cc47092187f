#include "kernels/cluster_traversal.h"

namespace batchenc {

MeshAdjacency MeshAdjacency::of(std::span<const Triangle> triangles, std::int64_t vertex_count) {
    MeshAdjacency adjacency;
    adjacency.first.assign(static_cast<std::size_t>(vertex_count) + 1, 0);
    adjacency.neighbours.resize(3 * triangles.size());
    for (const Triangle& t : triangles) {
        for (const std::int32_t v : t) ++adjacency.first[static_cast<std::size_t>(v) + 1];
    }
    for (std::size_t v = 0; v < static_cast<std::size_t>(vertex_count); ++v)
        adjacency.first[v + 1] += adjacency.first[v];
    // Filling moves each start to the next vertex' start; shifting back restores it.
    for (const Triangle& t : triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            std::int32_t& at = adjacency.first[static_cast<std::size_t>(t[k])];
            adjacency.neighbours[static_cast<std::size_t>(at++)] = t[(k + 1) % 3];
        }
    }
    for (std::size_t v = static_cast<std::size_t>(vertex_count); v > 0; --v)
        adjacency.first[v] = adjacency.first[v - 1];
    adjacency.first[0] = 0;
    return adjacency;
}

ClusterTraversal traverse_cluster(const MeshAdjacency& adjacency, std::span<const std::int32_t> members,
                                  std::span<const std::int32_t> owner, std::int32_t cluster,
                                  std::span<std::int32_t> position) {
    ClusterTraversal traversal;
    traversal.vertices.reserve(members.size());
    traversal.predecessors.assign(members.size() * ClusterTraversal::kMaxPredecessors,
                                  static_cast<std::int32_t>(members.size()));
    traversal.predecessor_count.resize(members.size());
    for (const std::int32_t root : members) {
        if (position[static_cast<std::size_t>(root)] >= 0) continue;
        position[static_cast<std::size_t>(root)] = static_cast<std::int32_t>(traversal.vertices.size());
        traversal.vertices.push_back(root);
        for (std::size_t at = traversal.vertices.size() - 1; at < traversal.vertices.size(); ++at) {
            const auto v = static_cast<std::size_t>(traversal.vertices[at]);
            std::int32_t* predecessors =
                traversal.predecessors.data() + at * ClusterTraversal::kMaxPredecessors;
            int count = 0;
            for (std::int32_t k = adjacency.first[v]; k < adjacency.first[v + 1]; ++k) {
                const std::int32_t w = adjacency.neighbours[static_cast<std::size_t>(k)];
                if (owner[static_cast<std::size_t>(w)] != cluster) continue;
                std::int32_t& place = position[static_cast<std::size_t>(w)];
                if (place < 0) {
                    place = static_cast<std::int32_t>(traversal.vertices.size());
                    traversal.vertices.push_back(w);
                } else if (place < static_cast<std::int32_t>(at) &&
                           count < ClusterTraversal::kMaxPredecessors) {
                    predecessors[count++] = place;
                }
            }
            traversal.predecessor_count[at] = static_cast<std::uint8_t>(count);
        }
    }
    return traversal;
}

}  // namespace batchenc
