#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "codecs/coded_segmentation.h"
#include "codecs/rtpca_analysis.h"
#include "kernels/bounding_box.h"
#include "kernels/byte_stream.h"
#include "kernels/rigid_motion.h"
#include "kernels/vector3.h"

namespace batchenc {
namespace {

/// A component whose singular value per vertex is less costs more than it gives.
constexpr double kLeastDeviation = 0.6;  // steps

/// A quantised basis vector is of use as far as this part of its square is in none before it.
constexpr float kLeastFresh = 0.1f;

/// Quantised targets are no larger: what is coded are differences of them.
constexpr float kLargestTarget = static_cast<float>(kLargestFieldValue) / 2.0f;

// Rotation vectors that have grown longer with turn after turn begin again: float32 has all steps up to the
// first, and decoders take no turns that are much beyond the second.
constexpr double kMostTurnSteps = 0x1p24;
constexpr double kLargestTurn = 1e5;  // radians

tl::unexpected<Error> too_fine() {
    return fail(ErrorCode::kLimit, "the step is too small for the extent of the clip; use a larger one");
}

bool in_range(std::span<const float> targets) {
    return std::all_of(targets.begin(), targets.end(),
                       [](float value) { return std::abs(value) <= kLargestTarget; });  // false of NaN
}

/// A cluster's local coordinates as trajectories: 3F × n, a vertex a column.
ColMajorMatrixXf trajectories(PositionsView positions, std::span<const std::int32_t> vertices,
                              const LocalFrameTrack& track) {
    const auto n = static_cast<std::int64_t>(vertices.size());
    ColMajorMatrixXf matrix(3 * positions.frame_count(), n);
    std::vector<float> local(static_cast<std::size_t>(3 * n));
    for (std::int64_t f = 0; f < positions.frame_count(); ++f) {
        to_local(positions.at(f, 0), vertices, track, f, local.data());
        for (std::int64_t k = 0; k < n; ++k) std::copy_n(local.data() + 3 * k, 3, &matrix(3 * f, k));
    }
    return matrix;
}

/// Mean over the frames of every trajectory: 3 × n.
ColMajorMatrixXd means_of(const ColMajorMatrixXf& matrix) {
    ColMajorMatrixXd means = ColMajorMatrixXd::Zero(3, matrix.cols());
    for (Eigen::Index k = 0; k < matrix.cols(); ++k) {
        const float* column = matrix.col(k).data();
        double* mean = means.col(k).data();
        for (Eigen::Index row = 0; row < matrix.rows(); row += 3) {
            for (Eigen::Index axis = 0; axis < 3; ++axis)
                mean[axis] += static_cast<double>(column[row + axis]);
        }
    }
    return means * (3.0 / static_cast<double>(matrix.rows()));
}

/// Takes three values away from every frame of each trajectory.
template <typename Place>
void subtract(ColMajorMatrixXf& matrix, Place place) {
    for (Eigen::Index k = 0; k < matrix.cols(); ++k) {
        const std::array<float, 3> rest = place(k);
        float* column = matrix.col(k).data();
        for (Eigen::Index row = 0; row < matrix.rows(); row += 3) {
            for (Eigen::Index axis = 0; axis < 3; ++axis)
                column[row + axis] -= rest[static_cast<std::size_t>(axis)];
        }
    }
}

/// How some vertices move rigidly from their places in the first frame, which are at rest. center: where the
/// origin of all places is put.
RigidBody rigid_body(PositionsView positions, const std::vector<std::int32_t>& vertices,
                     const std::array<double, 3>& center) {
    RigidBody body;
    body.vertex_count = static_cast<std::int64_t>(vertices.size());
    body.track.resize(static_cast<std::size_t>(positions.frame_count()));
    if (vertices.empty()) return body;
    const auto at_rest = [&](std::int32_t v) {
        const float* p = positions.at(0, v);
        return minus({p[0], p[1], p[2]}, center);
    };
    const auto count = static_cast<double>(vertices.size());
    std::array<double, 3> sum{};
    for (const std::int32_t v : vertices) sum = plus(sum, at_rest(v));
    body.center = {sum[0] / count, sum[1] / count, sum[2] / count};
    double squares = 0.0;
    for (const std::int32_t v : vertices) {
        for (const double d : minus(at_rest(v), body.center)) squares += d * d;
    }
    body.radius = std::sqrt(squares / count);
    const std::span<const float> rest(positions.data(),
                                      static_cast<std::size_t>(3 * positions.vertex_count()));
    const LocalFrameTrack track = rigid_motion(positions, vertices, rest);
    for (std::size_t f = 0; f < body.track.size(); ++f) {
        BodyMotion motion = BodyMotion::of(track, static_cast<std::int64_t>(f));
        const std::array<double, 3> origin = std::exchange(motion.translation, {});
        motion.translation = minus(minus(origin, center), motion.apply(body.center));
        body.track[f] = motion;
    }
    return body;
}

/// The components of one cluster as they are coded.
struct CodedComponents {
    std::vector<std::int32_t> scales;
    std::vector<TrackLevels> basis;
    std::vector<std::vector<std::int32_t>> fields;  // in the order of its FieldOrder
    std::vector<FieldPredictor> predictors;
    double squared_error = 0.0;
    bool fits = true;
};

/// Quantises the leading components of a cluster. matrix: 3F × n, a column for each of `vertices`.
CodedComponents quantize_components(const ColMajorMatrixXf& matrix, const TruncatedSvd& svd,
                                    std::int64_t count, const RtpcaHeader& header, const FieldOrder& order,
                                    std::span<const std::int32_t> vertices, const TrackTransform& transform) {
    CodedComponents coded;
    const auto step = static_cast<double>(header.step);
    std::vector<std::vector<float>> tracks;
    for (std::int64_t l = 0; l < count; ++l) {
        const double scale = 4.0 * std::log2(static_cast<double>(svd.singular_values[l]) / step);
        const auto rounded = static_cast<std::int32_t>(std::lround(scale));
        coded.fits = coded.fits && rounded <= RtpcaComponent::kLargestScale;
        coded.scales.push_back(std::clamp(rounded, 0, RtpcaComponent::kLargestScale));
        const float per_step = 1.0f / RtpcaComponent{0, coded.scales.back()}.basis_step();
        std::vector<float> track(static_cast<std::size_t>(matrix.rows()));
        for (Eigen::Index row = 0; row < matrix.rows(); ++row)
            track[static_cast<std::size_t>(row)] = svd.basis(row, l) * per_step;
        coded.fits = coded.fits && in_range(track);
        tracks.push_back(std::move(track));
    }
    if (!coded.fits) return coded;
    coded.basis = transform.quantize(tracks, SerialExecutor());
    // What quantisation has left of the basis, without vectors that are now nothing or mostly among those
    // before them: coefficients would be large and cancel out.
    const std::vector<std::vector<float>> decoded = transform.dequantize(coded.basis, SerialExecutor());
    std::vector<std::size_t> kept;
    ColMajorMatrixXf basis(matrix.rows(), count), directions(matrix.rows(), count);
    for (std::size_t l = 0; l < decoded.size(); ++l) {
        // (By levels: transforms take two tracks at once, and leave one a breath of the other.)
        const std::vector<std::int32_t>& values = coded.basis[l].values;
        if (std::all_of(values.begin(), values.end(), [](std::int32_t v) { return v == 0; })) continue;
        const auto used = static_cast<Eigen::Index>(kept.size());
        const auto levels = Eigen::Map<const Eigen::VectorXf>(decoded[l].data(), matrix.rows());
        const Eigen::VectorXf vector = levels * RtpcaComponent{0, coded.scales[l]}.basis_step();
        const Eigen::VectorXf fresh =
            vector - directions.leftCols(used) * (directions.leftCols(used).transpose() * vector);
        if (!(fresh.squaredNorm() > kLeastFresh * vector.squaredNorm())) continue;
        basis.col(used) = vector;
        directions.col(used) = fresh.normalized();
        kept.push_back(l);
    }
    basis.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(kept.size()));
    ColMajorMatrixXf error = matrix;
    std::vector<std::size_t> useful;
    if (!kept.empty()) {
        RowMajorMatrixXf coefficients = least_squares_coefficients(basis, matrix);
        std::vector<Eigen::Index> column_of(vertices.size());  // of each place in the order
        for (std::size_t place = 0; place < vertices.size(); ++place) {
            const auto at = std::lower_bound(vertices.begin(), vertices.end(), order.vertices[place]);
            column_of[place] = at - vertices.begin();
        }
        std::vector<float> targets(vertices.size());
        for (std::size_t k = 0; k < kept.size(); ++k) {
            const auto row = static_cast<Eigen::Index>(k);
            for (std::size_t place = 0; place < targets.size(); ++place)
                targets[place] = coefficients(row, column_of[place]) / header.step;
            coded.fits = coded.fits && in_range(targets);
            if (!coded.fits) return coded;
            std::vector<std::int32_t> field(targets.size());
            const FieldPredictor predictor = quantize_field(order, targets, field);
            for (std::size_t place = 0; place < targets.size(); ++place)
                coefficients(row, column_of[place]) = static_cast<float>(field[place]) * header.step;
            if (std::all_of(field.begin(), field.end(), [](std::int32_t v) { return v == 0; })) continue;
            useful.push_back(kept[k]);
            coded.fields.push_back(std::move(field));
            coded.predictors.push_back(predictor);
        }
        error.noalias() -= basis * coefficients;
    }
    for (std::size_t k = 0; k < useful.size(); ++k) {
        coded.scales[k] = coded.scales[useful[k]];
        if (k != useful[k]) coded.basis[k] = std::move(coded.basis[useful[k]]);
    }
    coded.scales.resize(useful.size());
    coded.basis.resize(useful.size());
    coded.squared_error = error.cast<double>().squaredNorm();
    return coded;
}

/// The mean shape as it is coded: x, y and z, each in the order of the shape.
struct CodedShape {
    std::array<std::vector<std::int32_t>, 3> fields;
    std::array<FieldPredictor, 3> predictors{};
};

/// Quantises the mean shape, and leaves in it what a decoder has. shape: 3 × V.
Expected<CodedShape> quantize_shape(const FieldOrder& order, std::vector<float>& shape, float step,
                                    const Executor& executor) {
    CodedShape coded;
    std::array<std::uint8_t, 3> fits{};
    executor.for_each(3, [&](std::int64_t index) {
        const auto axis = static_cast<std::size_t>(index);
        const auto value = [&](std::size_t place) -> float& {
            return shape[3 * static_cast<std::size_t>(order.vertices[place]) + axis];
        };
        std::vector<float> targets(order.vertices.size(), 0.0f);
        for (std::size_t place = 0; place < targets.size() && step > 0.0f; ++place)
            targets[place] = value(place) / step;
        fits[axis] = in_range(targets);
        if (fits[axis] == 0) return;
        std::vector<std::int32_t>& field = coded.fields[axis];
        field.resize(targets.size());
        coded.predictors[axis] = quantize_field(order, targets, field);
        for (std::size_t place = 0; place < targets.size(); ++place)
            value(place) = static_cast<float>(field[place]) * step;
    });
    if (std::count(fits.begin(), fits.end(), 0) > 0) return too_fine();
    return coded;
}

std::vector<std::uint8_t> code_shape(const FieldOrder& order, CodedShape shape) {
    BitCoder coder;
    FieldCoder fields;
    FieldMemory memory(order.size());
    for (std::size_t axis = 0; axis < 3; ++axis)
        fields.code(coder, order, memory, shape.predictors[axis], shape.fields[axis]);
    return coder.finish();
}

std::vector<std::uint8_t> code_basis(std::span<const RtpcaComponent> components,
                                     const std::vector<std::int32_t>& stream,
                                     std::vector<CodedComponents>& coded, std::int64_t frame_count) {
    BitCoder coder;
    TrackCoder tracks(frame_count);
    for_each_component(components, stream, coded.size(),
                       [&](const RtpcaComponent&, std::size_t i, std::size_t l) {
                           tracks.code(coder, coded[i].basis[l], l);
                           return true;
                       });
    return coder.finish();
}

std::vector<std::uint8_t> code_fields(std::span<const RtpcaComponent> components,
                                      const std::vector<std::int32_t>& stream,
                                      std::vector<CodedComponents>& coded,
                                      const std::vector<FieldOrder>& orders) {
    BitCoder coder;
    FieldCoder fields;
    std::vector<FieldMemory> memories = stream_memories(stream, orders);
    for_each_component(
        components, stream, coded.size(), [&](const RtpcaComponent&, std::size_t i, std::size_t l) {
            fields.code(coder, orders[i], memories[i], coded[i].predictors[l], coded[i].fields[l]);
            return true;
        });
    return coder.finish();
}

}  // namespace

std::int64_t RtpcaCoding::size_bytes() const {
    std::int64_t sum = 0;
    for (const auto& [id, payload] : sections) sum += static_cast<std::int64_t>(payload.size());
    return sum;
}

RtpcaAnalysis::RtpcaAnalysis(PositionsView positions, const MeshTopology& mesh,
                             std::span<const std::int32_t> labels, std::int32_t cluster_count,
                             const Executor& executor)
    : positions_(positions),
      mesh_(mesh),
      labels_(labels),
      executor_(executor),
      clusters_(static_cast<std::size_t>(cluster_count)),
      transform_(positions.frame_count()) {
    const BoundingBox box = bounding_box(positions);
    e_max_ = box.largest_side();
    center_ = box.center();
    for (std::size_t v = 0; v < labels.size(); ++v)
        clusters_[static_cast<std::size_t>(labels[v])].vertices.push_back(static_cast<std::int32_t>(v));
    executor.for_each(cluster_count, [&](std::int64_t i) {
        Cluster& cluster = clusters_[static_cast<std::size_t>(i)];
        cluster.body = rigid_body(positions, cluster.vertices, {center_[0], center_[1], center_[2]});
    });
    std::vector<RigidBody> bodies;
    for (const Cluster& cluster : clusters_) bodies.push_back(cluster.body);
    tree_ = RigidTree::of(bodies);
}

Expected<CodedBody> RtpcaAnalysis::quantize_body(const RtpcaHeader& header, const RigidBody& body,
                                                 const BodyTrack& relative,
                                                 const std::array<double, 3>& joint) const {
    CodedBody result;
    const double cell = CodedBody::joint_cell(header);
    double squared = body.radius * body.radius;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double cells = cell > 0.0 ? joint[axis] / cell : 0.0;
        result.joint[axis] = static_cast<std::int32_t>(std::lround(std::clamp(cells, -1e6, 1e6)));
        squared += (joint[axis] - body.center[axis]) * (joint[axis] - body.center[axis]);
    }
    const double radius = squared > 0.0 ? 2.0 * std::log2(e_max_ / std::sqrt(squared)) : 0.0;
    result.radius = static_cast<std::int32_t>(
        std::lround(std::clamp(radius, 0.0, static_cast<double>(CodedBody::kLargestRadius))));

    const double turn = result.rotation_step(header, body.vertex_count);
    const auto step = static_cast<double>(header.body_step(body.vertex_count));
    const std::array<double, 3> at_rest = result.joint_place(header);
    std::vector<std::vector<float>> targets(2, std::vector<float>(3 * relative.size(), 0.0f));
    std::array<double, 3> vector{};
    const double farthest = std::min(kMostTurnSteps * turn, kLargestTurn);
    for (std::size_t f = 0; f < relative.size() && step > 0.0; ++f) {
        vector = rotation_vector(relative[f].rotation, vector);
        if (norm(vector) > farthest) vector = rotation_vector(relative[f].rotation, {});
        const std::array<double, 3> place = relative[f].apply(at_rest);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            targets[0][3 * f + axis] = static_cast<float>(vector[axis] / turn);
            targets[1][3 * f + axis] = static_cast<float>(place[axis] / step);
        }
    }
    if (!in_range(targets[0]) || !in_range(targets[1])) return too_fine();
    std::vector<TrackLevels> levels = transform_.quantize(targets, SerialExecutor());
    result.rotation = std::move(levels[0]);
    result.path = std::move(levels[1]);
    return result;
}

Expected<std::vector<CodedBody>> RtpcaAnalysis::quantize_bodies(const RtpcaHeader& header,
                                                                std::vector<LocalFrameTrack>& tracks) const {
    std::vector<CodedBody> coded(clusters_.size());
    std::vector<BodyTrack> decoded(clusters_.size());
    const std::int64_t frames = positions_.frame_count();
    for (const std::int32_t index : tree_.order) {
        const auto i = static_cast<std::size_t>(index);
        const RigidBody& body = clusters_[i].body;
        auto best = quantize_body(header, body, body.track, body.center);
        const BodyTrack* parent = nullptr;
        if (tree_.parent[i] >= 0) {  // where that is cheaper
            const BodyTrack& candidate = decoded[static_cast<std::size_t>(tree_.parent[i])];
            BodyTrack relative = body.track;
            for (std::size_t f = 0; f < relative.size(); ++f)
                relative[f] = relative[f].relative_to(candidate[f]);
            for (const std::array<double, 3>& joint :
                 {body.center, joint_of(relative, body.center, body.radius)}) {
                auto other = quantize_body(header, body, relative, joint);
                if (!other || (best && !(other->cost() < best->cost()))) continue;
                best = std::move(other);
                best->parent = tree_.parent[i];
                parent = &candidate;
            }
        }
        if (!best) return tl::unexpected(best.error());
        coded[i] = std::move(*best);
        decoded[i] = coded[i].track(parent, header, body.vertex_count, transform_);
    }
    tracks.assign(clusters_.size(), LocalFrameTrack(frames));
    for (std::size_t i = 0; i < clusters_.size(); ++i) {
        for (std::int64_t f = 0; f < frames; ++f)
            tracks[i].set(f, decoded[i][static_cast<std::size_t>(f)].moved_by(center_).local_frame());
    }
    return coded;
}

Expected<void> RtpcaAnalysis::decompose(double step) {
    std::vector<std::optional<Error>> errors(clusters_.size());
    executor_.for_each(static_cast<std::int64_t>(clusters_.size()), [&](std::int64_t index) {
        Cluster& cluster = clusters_[static_cast<std::size_t>(index)];
        const double floor = kLeastDeviation * step * std::sqrt(static_cast<double>(cluster.size()));
        if (cluster.vertices.empty() || (cluster.svd_floor >= 0.0 && cluster.svd_floor <= floor)) return;
        LocalFrameTrack track(positions_.frame_count());
        for (std::int64_t f = 0; f < positions_.frame_count(); ++f) {
            const BodyMotion& motion = cluster.body.track[static_cast<std::size_t>(f)];
            track.set(f, motion.moved_by(center_).local_frame());
        }
        ColMajorMatrixXf matrix = trajectories(positions_, cluster.vertices, track);
        const ColMajorMatrixXd means = means_of(matrix);
        subtract(matrix, [&](Eigen::Index k) {
            return std::array<float, 3>{static_cast<float>(means(0, k)), static_cast<float>(means(1, k)),
                                        static_cast<float>(means(2, k))};
        });
        auto svd = svd_above(matrix, floor);
        if (svd) {
            cluster.svd = std::move(*svd);
            cluster.svd_floor = floor;
        } else {
            errors[static_cast<std::size_t>(index)] = svd.error();
        }
    });
    for (std::size_t i = 0; i < errors.size(); ++i) {
        if (errors[i]) return fail_within("cluster " + std::to_string(i), *errors[i]);
    }
    return {};
}

Expected<RtpcaCoding> RtpcaAnalysis::code(double step) {
    RtpcaHeader header;
    header.step = static_cast<float>(step);
    header.e_max = static_cast<float>(e_max_);
    header.center = center_;
    header.cluster_count = static_cast<std::int32_t>(clusters_.size());
    if (!std::isfinite(header.e_max) || !std::isfinite(header.step))
        return fail(ErrorCode::kLimit, "the bounding box is larger than float32 can say");
    if (auto done = decompose(step); !done) return tl::unexpected(done.error());

    std::vector<LocalFrameTrack> tracks;
    auto bodies = quantize_bodies(header, tracks);
    if (!bodies) return tl::unexpected(bodies.error());
    const auto count = static_cast<std::int64_t>(clusters_.size());
    std::vector<ColMajorMatrixXf> matrices(clusters_.size());
    std::vector<float> shape(3 * labels_.size());
    executor_.for_each(count, [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        matrices[i] = trajectories(positions_, clusters_[i].vertices, tracks[i]);
        const ColMajorMatrixXd means = means_of(matrices[i]);
        for (std::size_t k = 0; k < clusters_[i].vertices.size(); ++k) {
            for (std::size_t axis = 0; axis < 3; ++axis)
                shape[3 * static_cast<std::size_t>(clusters_[i].vertices[k]) + axis] =
                    static_cast<float>(means(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(k)));
        }
    });

    const auto shape_fields =
        quantize_shape(mesh_.field_order(), shape, header.shape_step(positions_.frame_count()), executor_);
    if (!shape_fields) return tl::unexpected(shape_fields.error());
    const std::vector<FieldOrder> orders = cluster_orders(mesh_, labels_, header.cluster_count, shape);

    // Components.
    std::vector<CodedComponents> coded(clusters_.size());
    executor_.for_each(count, [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        if (clusters_[i].vertices.empty()) return;
        subtract(matrices[i], [&](Eigen::Index k) {
            const float* rest = shape.data() + 3 * static_cast<std::ptrdiff_t>(
                                                       clusters_[i].vertices[static_cast<std::size_t>(k)]);
            return std::array<float, 3>{rest[0], rest[1], rest[2]};
        });
        const double floor = kLeastDeviation * step * std::sqrt(static_cast<double>(clusters_[i].size()));
        std::int64_t wanted = 0;
        while (wanted < clusters_[i].svd.singular_values.size() &&
               static_cast<double>(clusters_[i].svd.singular_values[wanted]) > floor)
            ++wanted;
        coded[i] = quantize_components(matrices[i], clusters_[i].svd, wanted, header, orders[i],
                                       clusters_[i].vertices, transform_);
        matrices[i].resize(0, 0);
    });
    RtpcaCoding result;
    result.step = step;
    std::vector<RtpcaComponent> components;
    std::vector<std::int64_t> sizes;
    for (std::size_t i = 0; i < coded.size(); ++i) {
        if (!coded[i].fits) return too_fine();
        result.squared_error += coded[i].squared_error;
        sizes.push_back(clusters_[i].size());
        for (const std::int32_t scale : coded[i].scales)
            components.push_back({static_cast<std::int32_t>(i), scale});
    }
    // Stable, and scales of a cluster do not rise: its own order is kept.
    std::stable_sort(components.begin(), components.end(),
                     [](const RtpcaComponent& a, const RtpcaComponent& b) { return a.scale > b.scale; });
    header.component_count = static_cast<std::int64_t>(components.size());

    // Everything is an integer now; all streams are coded at once.
    const Streams streams = rtpca_streams(components, sizes, positions_.frame_count());
    std::vector<std::uint8_t> motions;
    std::vector<std::vector<std::uint8_t>> basis(streams.size()), fields(streams.size() + 1);
    executor_.for_each(static_cast<std::int64_t>(2 * streams.size()) + 2, [&](std::int64_t index) {
        const auto task = static_cast<std::size_t>(index);
        if (task == 0) {
            BitCoder coder;
            code_bodies(coder, *bodies, positions_.frame_count());
            motions = coder.finish();
        } else if (task == 1) {
            fields[0] = code_shape(mesh_.field_order(), *shape_fields);
        } else if (const std::size_t s = (task - 2) / 2; task % 2 == 0) {
            basis[s] = code_basis(components, streams[s], coded, positions_.frame_count());
        } else {
            fields[s + 1] = code_fields(components, streams[s], coded, orders);
        }
    });
    BitCoder coder;
    code_components(coder, components, header.cluster_count);
    const std::vector<std::uint8_t> list = coder.finish();

    ByteWriter basis_section, fields_section;
    basis_section.put_varint(list.size());
    basis_section.put_bytes(list);
    append_parts(basis_section, basis);
    append_parts(fields_section, fields);
    result.sections.emplace_back(SectionId::kParameters, header.write());
    result.sections.emplace_back(SectionId::kSegmentation,
                                 write_segmentation(labels_, {}, header.cluster_count, mesh_.adjacency()));
    result.sections.emplace_back(SectionId::kFrames, std::move(motions));
    result.sections.emplace_back(SectionId::kBasis, basis_section.take());
    result.sections.emplace_back(SectionId::kCoefficients, fields_section.take());
    return result;
}

}  // namespace batchenc
