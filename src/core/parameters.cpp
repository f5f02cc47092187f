#include "core/parameters.h"

#include <cmath>
#include <string>
#include <vector>

namespace batchenc {
namespace {

Expected<void> check_range(const char* name, std::int32_t value, std::int32_t low, std::int32_t high) {
    if (value >= low && value <= high) return {};
    return fail(ErrorCode::kInvalidArgument, std::string(name) + " is " + std::to_string(value) +
                                                 ", outside " + std::to_string(low) + " to " +
                                                 std::to_string(high));
}

}  // namespace

std::string_view to_name(CodecMethod method) {
    switch (method) {
        case CodecMethod::kAuto:
            return "auto";
        case CodecMethod::kStatic:
            return "static";
        case CodecMethod::kSplitcoder:
            return "splitcoder";
        case CodecMethod::kRlpca:
            return "rlpca";
        case CodecMethod::kOrlpca:
            return "orlpca";
        case CodecMethod::kPdct:
            return "pdct";
        case CodecMethod::kRtpca:
            return "rtpca";
        case CodecMethod::kBaselineStatic:
            return "baseline-static";
        case CodecMethod::kBaselineLpc:
            return "baseline-lpc";
        case CodecMethod::kBaselineDynapack:
            return "baseline-dynapack";
        case CodecMethod::kBaselineAngle:
            return "baseline-angle";
        case CodecMethod::kBaselinePca:
            return "baseline-pca";
        case CodecMethod::kBaselinePcaLpc:
            return "baseline-pca-lpc";
        case CodecMethod::kBaselineCpca:
            return "baseline-cpca";
        case CodecMethod::kBaselineCoddyac:
            return "baseline-coddyac";
        case CodecMethod::kBaselineAffine:
            return "baseline-affine";
        case CodecMethod::kBaselineOctree:
            return "baseline-octree";
        case CodecMethod::kBaselineWavelet:
            return "baseline-wavelet";
    }
    return "unknown";
}

std::string_view to_name(SegmentationMethod method) {
    switch (method) {
        case SegmentationMethod::kRegionGrowing:
            return "region-growing";
        case SegmentationMethod::kClustering:
            return "clustering";
        case SegmentationMethod::kAdaptive:
            return "adaptive";
        case SegmentationMethod::kRigid:
            return "rigid";
    }
    return "unknown";
}

std::string_view to_name(CoordinateSpace space) {
    switch (space) {
        case CoordinateSpace::kLocal:
            return "local";
        case CoordinateSpace::kWorld:
            return "world";
    }
    return "unknown";
}

std::string_view to_name(GeometryPredictor predictor) {
    switch (predictor) {
        case GeometryPredictor::kAuto:
            return "auto";
        case GeometryPredictor::kParallelogram:
            return "parallelogram";
        case GeometryPredictor::kMultiway:
            return "multiway";
        case GeometryPredictor::kLocalParallelogram:
            return "local-parallelogram";
        case GeometryPredictor::kLocalMultiway:
            return "local-multiway";
        case GeometryPredictor::kFitted:
            return "fitted";
        case GeometryPredictor::kToumaGotsman:
            return "touma-gotsman";
        case GeometryPredictor::kHope:
            return "hope";
        case GeometryPredictor::kHopi:
            return "hopi";
        case GeometryPredictor::kHops:
            return "hops";
        case GeometryPredictor::kWeighted:
            return "weighted";
        case GeometryPredictor::kTime:
            return "time";
        case GeometryPredictor::kSpace:
            return "space";
        case GeometryPredictor::kSpaceMultiway:
            return "space-multiway";
        case GeometryPredictor::kSpaceTime:
            return "space-time";
        case GeometryPredictor::kSpaceTimeMultiway:
            return "space-time-multiway";
        case GeometryPredictor::kLorenzo:
            return "lorenzo";
        case GeometryPredictor::kLorenzoMultiway:
            return "lorenzo-multiway";
        case GeometryPredictor::kReplica:
            return "replica";
    }
    return "unknown";
}

std::string_view to_name(MeshOrder order) {
    switch (order) {
        case MeshOrder::kFree:
            return "free";
        case MeshOrder::kPreserve:
            return "preserve";
    }
    return "unknown";
}

std::string_view to_name(TangentialPredictor predictor) {
    switch (predictor) {
        case TangentialPredictor::kParallelogram:
            return "parallelogram";
        case TangentialPredictor::kMultiway:
            return "multiway";
        case TangentialPredictor::kFitted:
            return "fitted";
        case TangentialPredictor::kWeighted:
            return "weighted";
    }
    return "unknown";
}

std::string_view to_name(CoefficientAllocation allocation) {
    switch (allocation) {
        case CoefficientAllocation::kFixed:
            return "fixed";
        case CoefficientAllocation::kRd:
            return "rd";
    }
    return "unknown";
}

std::string_view to_name(PdctTransform transform) {
    switch (transform) {
        case PdctTransform::kSpatial:
            return "spatial";
        case PdctTransform::kTemporal:
            return "temporal";
    }
    return "unknown";
}

bool is_in_range(const NormalFit& fit) {
    return (fit.vertices == 0 || (fit.vertices >= 3 && fit.vertices <= 64)) &&
           (fit.exponent == -1.0f || (fit.exponent >= 0.0f && fit.exponent <= 8.0f)) &&
           (fit.cosine == -1.0f || (fit.cosine >= 0.0f && fit.cosine <= 1.0f));
}

std::string_view to_name(NormalPredictor predictor) {
    switch (predictor) {
        case NormalPredictor::kTime:
            return "time";
        case NormalPredictor::kSpace:
            return "space";
        case NormalPredictor::kSpaceTime:
            return "space-time";
    }
    return "unknown";
}

std::string_view to_name(RateMeasure rate) {
    switch (rate) {
        case RateMeasure::kVectors:
            return "vectors";
        case RateMeasure::kBits:
            return "bits";
    }
    return "unknown";
}

std::string_view to_name(CodecTarget target) {
    switch (target) {
        case CodecTarget::kMaxError:
            return "max_error";
        case CodecTarget::kMaxErrorRelative:
            return "max_error_relative";
        case CodecTarget::kKg:
            return "kg";
        case CodecTarget::kDa:
            return "da";
        case CodecTarget::kBpvf:
            return "bpvf";
        case CodecTarget::kComponents:
            return "components";
    }
    return "unknown";
}

NormalFit own_fit(const NormalFit& fit, GeometryPredictor predictor) {
    const NormalFit own =
        predictor == GeometryPredictor::kHopi ? NormalFit{8, 2.68f, 0.9f} : NormalFit{18, 1.3f, 0.5f};
    return {fit.vertices > 0 ? fit.vertices : own.vertices,
            fit.exponent >= 0.0f ? fit.exponent : own.exponent, fit.cosine >= 0.0f ? fit.cosine : own.cosine};
}

bool is_baseline(CodecMethod method) { return method >= CodecMethod::kBaselineStatic; }

bool has_components(CodecMethod method) {
    return method == CodecMethod::kRlpca || method == CodecMethod::kOrlpca || counts_clusters(method) ||
           (method >= CodecMethod::kBaselinePca && method <= CodecMethod::kBaselineCoddyac);
}

bool uses_clusters(CodecMethod method) {
    if (is_baseline(method))
        return method == CodecMethod::kBaselineCpca || method == CodecMethod::kBaselineAffine;
    return method != CodecMethod::kStatic && method != CodecMethod::kSplitcoder;
}

bool counts_clusters(CodecMethod method) {
    return method == CodecMethod::kRtpca || method == CodecMethod::kAuto;
}

bool is_available(CodecMethod method) { return to_name(method) != "unknown"; }

bool takes_target(CodecMethod method, CodecTarget target) {
    const bool is_bound = target == CodecTarget::kMaxError || target == CodecTarget::kMaxErrorRelative;
    switch (method) {
        case CodecMethod::kStatic:
        case CodecMethod::kSplitcoder:
            return is_bound;
        case CodecMethod::kOrlpca:
            return !is_bound;
        case CodecMethod::kRtpca:
        case CodecMethod::kAuto:
            return target != CodecTarget::kComponents;
        default:
            return false;
    }
}

double value_of(const CodecParameters& parameters, CodecTarget target) {
    switch (target) {
        case CodecTarget::kMaxError:
            return parameters.max_error;
        case CodecTarget::kMaxErrorRelative:
            return parameters.max_error_relative;
        case CodecTarget::kKg:
            return parameters.target_kg;
        case CodecTarget::kDa:
            return parameters.target_da;
        case CodecTarget::kBpvf:
            return parameters.target_bpvf;
        case CodecTarget::kComponents:
            return parameters.target_components;
    }
    return 0.0;
}

bool has_predictor(CodecMethod method, GeometryPredictor predictor) {
    if (predictor == GeometryPredictor::kAuto) return true;
    if (is_baseline(method))
        return method == CodecMethod::kBaselineDynapack &&
               (predictor == GeometryPredictor::kLorenzo || predictor == GeometryPredictor::kReplica);
    const bool is_of_one_frame = predictor <= GeometryPredictor::kWeighted;
    if (method != CodecMethod::kSplitcoder) return is_of_one_frame;
    return !is_of_one_frame || predictor == GeometryPredictor::kFitted ||
           predictor == GeometryPredictor::kLocalMultiway;
}

Expected<void> check_parameters(const SegmentationParameters& parameters) {
    if (to_name(parameters.method) == "unknown") {
        return fail(ErrorCode::kUnsupported, "segmentation method " +
                                                 std::to_string(static_cast<int>(parameters.method)) +
                                                 " is not in this version");
    }
    if (!(parameters.threshold >= 0.0 && parameters.threshold <= 1.0))
        return fail(ErrorCode::kInvalidArgument, "segmentation.threshold is outside 0 to 1");
    return check_range("segmentation.clusters", parameters.clusters, 0, 65535);
}

Expected<void> check_values(const CodecParameters& parameters) {
    if (!is_available(parameters.method)) {
        return fail(ErrorCode::kUnsupported,
                    "codec method '" + std::string(to_name(parameters.method)) +
                        "' is not in this version; use rlpca, orlpca, pdct, splitcoder or static");
    }
    if (to_name(parameters.predictor) == "unknown") {
        return fail(ErrorCode::kUnsupported, "codec predictor " +
                                                 std::to_string(static_cast<int>(parameters.predictor)) +
                                                 " is not in this version");
    }
    for (const CodecTarget target : kCodecTargets) {
        const double value = value_of(parameters, target);
        if (!(value >= 0.0 && std::isfinite(value)))
            return fail(ErrorCode::kInvalidArgument,
                        "codec.target." + std::string(to_name(target)) + " is below 0 or not finite");
    }
    if (!(parameters.step >= 1e-7 && parameters.step <= 1.0))
        return fail(ErrorCode::kInvalidArgument, "codec.step is outside 1e-7 to 1");
    if (to_name(parameters.rate) == "unknown")
        return fail(ErrorCode::kUnsupported, "codec rate is not in this version");
    if (to_name(parameters.normal) == "unknown")
        return fail(ErrorCode::kUnsupported, "codec normal predictor is not in this version");
    if (parameters.space != CoordinateSpace::kLocal && parameters.space != CoordinateSpace::kWorld) {
        return fail(
            ErrorCode::kUnsupported,
            "codec space " + std::to_string(static_cast<int>(parameters.space)) + " is not in this version");
    }
    if (!is_in_range(parameters.fit))
        return fail(ErrorCode::kInvalidArgument,
                    "codec.fit_vertices, fit_exponent or fit_cosine is outside its range");
    if (to_name(parameters.transform) == "unknown" || to_name(parameters.allocation) == "unknown")
        return fail(ErrorCode::kUnsupported, "codec transform or allocation is not in this version");
    if (!(parameters.keep >= 0.0 && parameters.keep <= 1.0))
        return fail(ErrorCode::kInvalidArgument, "codec.keep is outside 0 to 1");
    constexpr std::int32_t kMostComponents = 65535 * 4096;  // of all clusters that there can be
    const bool has_fewer_bits = parameters.method == CodecMethod::kPdct ||
                                parameters.method == CodecMethod::kSplitcoder ||
                                is_baseline(parameters.method);
    return check_range("codec.bits", parameters.bits, 4, has_fewer_bits ? 20 : 24)
        .and_then([&] { return check_range("codec.components", parameters.components, 1, 4096); })
        .and_then([&] {
            return check_range("codec.target.components", parameters.target_components, 0, kMostComponents);
        })
        .and_then([&] { return check_range("codec.basis_bits", parameters.basis_bits, 2, 20); })
        .and_then([&] { return check_range("codec.coefficient_bits", parameters.coefficient_bits, 2, 20); })
        .and_then([&] { return check_range("codec.frame_bits", parameters.frame_bits, 4, 22); })
        .and_then([&] { return check_range("codec.lpc_order", parameters.lpc_order, 1, 2); })
        .and_then([&] { return check_range("codec.block", parameters.block, 2, 256); })
        .and_then([&] { return check_range("codec.intra_bits", parameters.intra_bits, 4, 20); });
}

namespace {

/// Names of all targets that a method takes, "a, b or c"; empty where it takes none.
std::string targets_of(CodecMethod method) {
    std::vector<std::string_view> names;
    for (const CodecTarget target : kCodecTargets)
        if (takes_target(method, target)) names.push_back(to_name(target));
    std::string list;
    for (std::size_t i = 0; i < names.size(); ++i)
        list += (i == 0 ? "" : i + 1 < names.size() ? ", " : " or ") + std::string(names[i]);
    return list;
}

/// At most one target, one that the method takes, and one at least where nothing else says how much to keep.
Expected<void> check_target(const CodecParameters& parameters) {
    const std::string method = "codec.method '" + std::string(to_name(parameters.method)) + "'";
    std::string_view chosen;
    for (const CodecTarget target : kCodecTargets) {
        if (value_of(parameters, target) == 0.0) continue;
        const std::string_view name = to_name(target);
        if (!takes_target(parameters.method, target)) {
            const std::string others = targets_of(parameters.method);
            return fail(ErrorCode::kUnsupported,
                        "codec.target." + std::string(name) + ": " + method + " takes " +
                            (others.empty() ? "no targets" : "other targets: " + others));
        }
        if (!chosen.empty())
            return fail(ErrorCode::kInvalidArgument, "codec.target: " + std::string(chosen) + " and " +
                                                         std::string(name) + " exclude each other");
        chosen = name;
    }
    if (chosen.empty() && parameters.method == CodecMethod::kOrlpca)
        return fail(ErrorCode::kInvalidArgument,
                    method + " needs a codec.target: " + targets_of(parameters.method));
    return {};
}

}  // namespace

Expected<void> check_parameters(const CodecParameters& parameters) {
    if (auto checked = check_values(parameters); !checked) return checked;
    if (!has_predictor(parameters.method, parameters.predictor)) {
        return fail(ErrorCode::kInvalidArgument,
                    "codec.predictor '" + std::string(to_name(parameters.predictor)) +
                        "' is not one of codec.method '" + std::string(to_name(parameters.method)) + "'");
    }
    return check_target(parameters);
}

}  // namespace batchenc
