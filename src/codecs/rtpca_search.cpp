#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "codecs/rate_model.h"
#include "codecs/rtpca.h"
#include "codecs/rtpca_analysis.h"
#include "kernels/bounding_box.h"
#include "kernels/error_metrics.h"

namespace batchenc {
namespace {

constexpr int kMostTrials = 12;

std::vector<std::uint8_t> bitstream_of(const RtpcaAnalysis& analysis, const RtpcaCoding& coding) {
    return write_clip_bitstream(CodecMethod::kRtpca, analysis.positions().vertex_count(),
                                analysis.positions().frame_count(), coding.sections);
}

/// How far what a decoder makes of a coding is from its source.
Expected<ErrorMetrics> measure(const RtpcaAnalysis& analysis, const RtpcaCoding& coding) {
    const PositionsView source = analysis.positions();
    const auto decoded =
        reconstruct_rtpca(bitstream_of(analysis, coding), analysis.mesh(), analysis.executor());
    if (!decoded) return tl::unexpected(decoded.error());
    ErrorMeter meter(source.vertex_count());
    meter.add(source, {decoded->data(), source.frame_count(), source.vertex_count()}, analysis.executor());
    return meter.finish();
}

/// The largest step whose measure is no larger than wanted: a secant search in logarithms that keeps what it
/// has bracketed.
class StepSearch {
 public:
    /// slope: of the logarithm of the measure over that of the step, to begin with; its sign holds.
    StepSearch(double wanted, double slope) : wanted_(wanted), slope_(slope) {}

    /// Takes note of a trial.
    void add(double step, double measure) {
        const Point point = {std::log(step), std::log(std::max(measure, std::numeric_limits<double>::min()))};
        auto& side = measure <= wanted_ ? safe_ : over_;
        const bool is_closer = !side || (measure <= wanted_ ? point.y > side->y : point.y < side->y);
        if (last_ && std::abs(point.x - last_->x) > 1e-6) {
            const double seen = (point.y - last_->y) / (point.x - last_->x);
            if (seen * slope_ > 0.0) slope_ = std::copysign(std::clamp(std::abs(seen), 0.2, 3.0), slope_);
        }
        last_ = point;
        if (is_closer) side = point;
    }

    /// The step to try next.
    double next() const {
        const double aim = std::log(wanted_ * kAim);
        if (safe_ && over_) {
            const double part = (aim - safe_->y) / (over_->y - safe_->y);
            return std::exp(safe_->x + std::clamp(part, 0.1, 0.9) * (over_->x - safe_->x));
        }
        constexpr double kLongest = 2.0794415416798357;  // eight times
        return std::exp(last_->x + std::clamp((aim - last_->y) / slope_, -kLongest, kLongest));
    }

    /// Whether the best trial is good enough after so many.
    bool is_done(int trials) const {
        return safe_ && safe_->y >= std::log(wanted_ * (trials < 8 ? 0.96 : 0.9));
    }
    bool is_best_safe() const { return safe_ && last_ && safe_->x == last_->x; }

 private:
    static constexpr double kAim = 0.98;  // of what is wanted
    struct Point {
        double x, y;
    };
    double wanted_, slope_;
    std::optional<Point> safe_, over_, last_;
};

/// Codes to a rate or an error.
Expected<RtpcaCoding> code_to_target(RtpcaAnalysis& analysis, CodecTarget target, double wanted) {
    const PositionsView positions = analysis.positions();
    const bool is_rate = target == CodecTarget::kBpvf;
    const double places = static_cast<double>(positions.vertex_count() * positions.frame_count());
    const auto value_of_coding = [&](const RtpcaCoding& coding) -> Expected<double> {
        if (is_rate) return 8.0 * static_cast<double>(bitstream_of(analysis, coding).size()) / places;
        const auto metrics = measure(analysis, coding);
        if (!metrics) return tl::unexpected(metrics.error());
        return target == CodecTarget::kDa ? metrics->da : metrics->kg;
    };
    if (analysis.e_max() == 0.0) return analysis.code(0.0);
    StepSearch search(wanted, is_rate ? -0.6 : 0.9);
    const double finest = 1e-7 * analysis.e_max(), coarsest = analysis.e_max();
    double step = is_rate ? 1e-3 * analysis.e_max() : 3e-3 * wanted * analysis.e_max();
    double least = std::numeric_limits<double>::infinity();
    std::optional<RtpcaCoding> best;
    for (int trials = 1; trials <= kMostTrials; ++trials) {
        step = std::clamp(step, finest, coarsest);
        auto coding = analysis.code(step);
        if (!coding) {
            if (best && coding.error().code == ErrorCode::kLimit) break;
            return coding;
        }
        const auto value = value_of_coding(*coding);
        if (!value) return tl::unexpected(value.error());
        if (std::isnan(*value)) {
            return fail(ErrorCode::kInvalidArgument,
                        "codec.target." + std::string(to_name(target)) +
                            " is undefined for this clip, as nothing in it varies");
        }
        least = std::min(least, *value);
        search.add(step, *value);
        if (search.is_best_safe()) best = std::move(*coding);
        const double next = std::clamp(search.next(), finest, coarsest);
        if (search.is_done(trials) || std::abs(next / step - 1.0) < 1e-4) break;
        step = next;
    }
    if (!best) {
        return fail(ErrorCode::kLimit,
                    "codec.target." + std::string(to_name(target)) + " of " + std::to_string(wanted) +
                        " is beyond reach; the least that came out is " + std::to_string(least));
    }
    return std::move(*best);
}

/// Codes within a bound: the step at which coding and corrections together are smallest.
Expected<RtpcaCoding> code_within(RtpcaAnalysis& analysis, double bound) {
    std::map<int, RtpcaCoding> trials;  // by half octaves of the step about the bound
    std::optional<Error> error;
    const auto size_at = [&](int place) {
        if (const auto done = trials.find(place); done != trials.end()) return done->second.size_bytes();
        constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
        if (static_cast<int>(trials.size()) == kMostTrials) return kNever;
        auto coding = analysis.code(bound * std::exp2(0.5 * place));
        if (coding) {
            const std::vector<std::uint8_t> bitstream = bitstream_of(analysis, *coding);
            const auto clip = parse_clip_bitstream(bitstream);
            auto residuals = encode_rtpca_residuals(*clip, analysis.mesh(), analysis.positions(), bound,
                                                    analysis.executor());
            if (residuals) {
                coding->sections.emplace_back(SectionId::kResiduals, std::move(*residuals));
                return trials.emplace(place, std::move(*coding)).first->second.size_bytes();
            }
            error = residuals.error();
        } else {
            error = coding.error();
        }
        return kNever;
    };
    // Downhill from the bound itself.
    int place = 0;
    for (int stride = 2; stride > 0; stride /= 2) {
        while (true) {
            const std::int64_t here = size_at(place);
            const int direction = size_at(place + stride) < here   ? 1
                                  : size_at(place - stride) < here ? -1
                                                                   : 0;
            if (direction == 0) break;
            place += direction * stride;
        }
    }
    if (trials.empty()) return tl::unexpected(*error);
    return std::move(trials.at(place));
}

/// The bound on every vertex that is asked for, world units; 0 for none.
double bound_asked(PositionsView positions, const CodecParameters& parameters) {
    if (parameters.max_error > 0.0) return parameters.max_error;
    if (parameters.max_error_relative > 0.0)
        return parameters.max_error_relative * bounding_box(positions).diagonal();
    return 0.0;
}

Expected<RtpcaCoding> code_as_asked(RtpcaAnalysis& analysis, const CodecParameters& parameters) {
    for (const CodecTarget target : {CodecTarget::kKg, CodecTarget::kDa, CodecTarget::kBpvf}) {
        if (const double wanted = value_of(parameters, target); wanted > 0.0)
            return code_to_target(analysis, target, wanted);
    }
    if (const double bound = bound_asked(analysis.positions(), parameters); bound > 0.0)
        return code_within(analysis, bound);
    return analysis.code(parameters.step * analysis.e_max());
}

/// A segmentation and what coding with it costs at one step: squared error, and what the bits are worth.
struct Division {
    Segmentation segmentation;
    double cost = 0.0;
};

Expected<Division> divide(PositionsView positions, const MeshTopology& mesh,
                          SegmentationParameters parameters, std::int32_t clusters, double step,
                          const Executor& executor) {
    parameters.clusters = clusters;
    auto segmentation = segment_clip(positions, mesh.triangles(), parameters, executor);
    if (!segmentation) return tl::unexpected(segmentation.error());
    RtpcaAnalysis analysis(positions, mesh, segmentation->labels, segmentation->cluster_count(), executor);
    const auto coding = analysis.code(step);
    if (!coding) return tl::unexpected(coding.error());
    const double bit = static_cast<double>(kErrorPerBit) * step * step;
    return Division{std::move(*segmentation),
                    coding->squared_error + 8.0 * bit * static_cast<double>(coding->size_bytes())};
}

/// The step that the parameters ask for, or lead to with a few clusters.
Expected<double> step_asked(PositionsView positions, const MeshTopology& mesh,
                            const SegmentationParameters& segmentation, const CodecParameters& parameters,
                            std::int32_t clusters, const Executor& executor) {
    if (const double bound = bound_asked(positions, parameters); bound > 0.0) return bound;
    if (!(parameters.target_kg > 0.0 || parameters.target_da > 0.0 || parameters.target_bpvf > 0.0))
        return parameters.step * bounding_box(positions).largest_side();
    SegmentationParameters few = segmentation;
    few.clusters = clusters;
    const auto divided = segment_clip(positions, mesh.triangles(), few, executor);
    if (!divided) return tl::unexpected(divided.error());
    RtpcaAnalysis analysis(positions, mesh, divided->labels, divided->cluster_count(), executor);
    const auto coding = code_as_asked(analysis, parameters);
    if (!coding) return tl::unexpected(coding.error());
    return coding->step;
}

}  // namespace

Expected<Segmentation> segment_for_rtpca(PositionsView positions, const MeshTopology& mesh,
                                         const SegmentationParameters& segmentation,
                                         const CodecParameters& parameters, const Executor& executor) {
    constexpr std::int64_t kLeastVertices = 8;  // of a cluster, on the average
    constexpr int kFirst = 6;                   // exponent of the first count tried: eight
    const std::int64_t most = std::max<std::int64_t>(1, positions.vertex_count() / kLeastVertices);
    const auto count_at = [&](int exponent) {
        const double count = std::round(std::exp2(0.5 * exponent));
        return static_cast<std::int32_t>(std::clamp(
            count, 1.0, static_cast<double>(std::min<std::int64_t>(most, kMostAutomaticClusters))));
    };
    const auto step = step_asked(positions, mesh, segmentation, parameters, count_at(kFirst), executor);
    if (!step) return tl::unexpected(step.error());
    // Downhill over half octaves of the count, whole ones first.
    std::map<std::int32_t, Division> tried;
    std::optional<Error> error;
    const auto cost_at = [&](int exponent) {
        const std::int32_t count = count_at(exponent);
        auto found = tried.find(count);
        if (found == tried.end()) {
            auto division = divide(positions, mesh, segmentation, count, *step, executor);
            if (!division) {
                error = division.error();
                return std::numeric_limits<double>::infinity();
            }
            found = tried.emplace(count, std::move(*division)).first;
        }
        return found->second.cost;
    };
    int exponent = kFirst;
    for (int stride = 2; stride > 0; --stride) {
        while (true) {
            const double here = cost_at(exponent);
            const int direction = cost_at(exponent + stride) < here   ? 1
                                  : cost_at(exponent - stride) < here ? -1
                                                                      : 0;
            if (direction == 0) break;
            exponent += direction * stride;
        }
    }
    if (tried.empty()) return tl::unexpected(*error);
    return std::move(tried.at(count_at(exponent)).segmentation);
}

Expected<EncodedClip> encode_rtpca(PositionsView positions, const MeshTopology& mesh,
                                   const Segmentation& segmentation, const CodecParameters& parameters,
                                   const Executor& executor) {
    RtpcaAnalysis analysis(positions, mesh, segmentation.labels, segmentation.cluster_count(), executor);
    const auto coding = code_as_asked(analysis, parameters);
    if (!coding) return tl::unexpected(coding.error());
    EncodedClip clip;
    clip.bitstream = bitstream_of(analysis, *coding);
    return clip;
}

}  // namespace batchenc
