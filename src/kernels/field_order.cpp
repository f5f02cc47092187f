#include "kernels/field_order.h"

#include <algorithm>
#include <numeric>

#include "kernels/mesh_topology.h"
#include "kernels/signal_order.h"

namespace batchenc {
namespace {

/// Neighbours of each place that come before it, ascending; compressed rows.
struct EarlierNeighbours {
    std::vector<std::int32_t> first, places;

    EarlierNeighbours(const MeshTopology& mesh, const MeshTraversal& traversal) {
        const std::vector<Triangle> triangles = traversal.in_places(mesh.triangles());
        first.assign(static_cast<std::size_t>(mesh.vertex_count()) + 1, 0);
        const auto for_each_edge = [&](auto use) {
            for (const Triangle& t : triangles) {
                for (std::size_t k = 0; k < 3; ++k) {
                    const std::int32_t a = t[k], b = t[(k + 1) % 3];
                    if (a != b) use(static_cast<std::size_t>(std::max(a, b)), std::min(a, b));
                }
            }
        };
        for_each_edge([&](std::size_t later, std::int32_t) { ++first[later + 1]; });
        std::partial_sum(first.begin(), first.end(), first.begin());
        places.resize(static_cast<std::size_t>(first.back()));
        std::vector<std::int32_t> at(first.begin(), first.end() - 1);
        for_each_edge([&](std::size_t later, std::int32_t earlier) {
            places[static_cast<std::size_t>(at[later]++)] = earlier;
        });
    }

    /// Without repetition; sorts in place.
    std::span<const std::int32_t> of(std::size_t place) {
        const auto begin = places.begin() + first[place], end = places.begin() + first[place + 1];
        std::sort(begin, end);
        return {begin, std::unique(begin, end)};
    }
};

}  // namespace

std::vector<FieldOrder> FieldOrder::of(const MeshTopology& mesh, std::span<const std::int32_t> labels,
                                       std::int32_t cluster_count) {
    const MeshTraversal& traversal = mesh.traversal();
    EarlierNeighbours earlier(mesh, traversal);
    std::vector<FieldOrder> orders(static_cast<std::size_t>(cluster_count));
    std::vector<std::int32_t> position(labels.size());  // by place, inside its cluster
    const auto label_of = [&](std::int32_t place) {
        return labels[static_cast<std::size_t>(traversal.order[static_cast<std::size_t>(place)])];
    };
    for (std::size_t place = 0; place < traversal.order.size(); ++place) {
        const std::int32_t label = label_of(static_cast<std::int32_t>(place));
        FieldOrder& order = orders[static_cast<std::size_t>(label)];
        const auto position_of = [&](std::int32_t p) { return position[static_cast<std::size_t>(p)]; };
        position[place] = static_cast<std::int32_t>(order.vertices.size());
        order.vertices.push_back(traversal.order[place]);
        for (const Gate& gate : traversal.gates_of(place)) {
            if (gate.opposite < 0 || label_of(gate.left) != label || label_of(gate.right) != label ||
                label_of(gate.opposite) != label)
                continue;
            order.gates.push_back(
                {position_of(gate.left), position_of(gate.right), position_of(gate.opposite)});
        }
        order.first_gate.push_back(static_cast<std::int32_t>(order.gates.size()));
        std::size_t count = 0;
        for (const std::int32_t p : earlier.of(place)) {
            if (label_of(p) != label || count == kMostNeighbours) continue;
            order.neighbours.push_back(position_of(p));
            ++count;
        }
        order.first_neighbour.push_back(static_cast<std::int32_t>(order.neighbours.size()));
    }
    return orders;
}

FieldOrder FieldOrder::of_whole(const MeshTopology& mesh) {
    const std::vector<std::int32_t> one_cluster(static_cast<std::size_t>(mesh.vertex_count()), 0);
    if (mesh.is_points()) {
        const std::vector<float> nowhere(3 * one_cluster.size(), 0.0f);  // leaves the order of the file
        return std::move(along_curve(nowhere, one_cluster, 1)[0]);
    }
    return std::move(of(mesh, one_cluster, 1)[0]);
}

std::vector<FieldOrder> FieldOrder::along_curve(std::span<const float> points,
                                                std::span<const std::int32_t> labels,
                                                std::int32_t cluster_count) {
    std::vector<FieldOrder> orders(static_cast<std::size_t>(cluster_count));
    for (const std::int32_t v : curve_order(points)) {
        FieldOrder& order = orders[static_cast<std::size_t>(labels[static_cast<std::size_t>(v)])];
        const auto place = static_cast<std::int32_t>(order.vertices.size());
        order.vertices.push_back(v);
        order.first_gate.push_back(0);
        for (std::int32_t back = 1; back <= std::min(place, 2); ++back)
            order.neighbours.push_back(place - back);
        order.first_neighbour.push_back(static_cast<std::int32_t>(order.neighbours.size()));
    }
    return orders;
}

}  // namespace batchenc
