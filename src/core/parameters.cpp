#include "core/parameters.h"

#include <limits>
#include <string>

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

NormalFit own_fit(const NormalFit& fit, GeometryPredictor predictor) {
    const NormalFit own =
        predictor == GeometryPredictor::kHopi ? NormalFit{8, 2.68f, 0.9f} : NormalFit{18, 1.3f, 0.5f};
    return {fit.vertices > 0 ? fit.vertices : own.vertices,
            fit.exponent >= 0.0f ? fit.exponent : own.exponent, fit.cosine >= 0.0f ? fit.cosine : own.cosine};
}

bool has_components(CodecMethod method) {
    return method == CodecMethod::kRlpca || method == CodecMethod::kOrlpca || method == CodecMethod::kRtpca;
}

bool uses_clusters(CodecMethod method) {
    return method != CodecMethod::kStatic && method != CodecMethod::kSplitcoder;
}

bool has_bound(CodecMethod method) {
    return method == CodecMethod::kStatic || method == CodecMethod::kSplitcoder;
}

bool has_predictor(CodecMethod method, GeometryPredictor predictor) {
    if (predictor == GeometryPredictor::kAuto) return true;
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
    if (parameters.method != CodecMethod::kRlpca && parameters.method != CodecMethod::kStatic &&
        parameters.method != CodecMethod::kPdct && parameters.method != CodecMethod::kSplitcoder) {
        return fail(ErrorCode::kUnsupported,
                    "codec method '" + std::string(to_name(parameters.method)) +
                        "' is not in this version; use rlpca, pdct, splitcoder or static");
    }
    if (to_name(parameters.predictor) == "unknown") {
        return fail(ErrorCode::kUnsupported, "codec predictor " +
                                                 std::to_string(static_cast<int>(parameters.predictor)) +
                                                 " is not in this version");
    }
    for (const double target : {parameters.max_error, parameters.max_error_relative}) {
        if (!(target >= 0.0 && target < std::numeric_limits<double>::infinity()))
            return fail(ErrorCode::kInvalidArgument, "codec.target: an error below 0 or not finite");
    }
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
    return check_range(
               "codec.bits", parameters.bits, 4,
               parameters.method == CodecMethod::kPdct || parameters.method == CodecMethod::kSplitcoder ? 20
                                                                                                        : 24)
        .and_then([&] { return check_range("codec.components", parameters.components, 1, 4096); })
        .and_then([&] { return check_range("codec.basis_bits", parameters.basis_bits, 2, 20); })
        .and_then([&] { return check_range("codec.coefficient_bits", parameters.coefficient_bits, 2, 20); })
        .and_then([&] { return check_range("codec.frame_bits", parameters.frame_bits, 4, 22); })
        .and_then([&] { return check_range("codec.block", parameters.block, 2, 256); })
        .and_then([&] { return check_range("codec.intra_bits", parameters.intra_bits, 4, 20); });
}

Expected<void> check_parameters(const CodecParameters& parameters) {
    if (auto checked = check_values(parameters); !checked) return checked;
    if (!has_predictor(parameters.method, parameters.predictor)) {
        return fail(ErrorCode::kInvalidArgument,
                    "codec.predictor '" + std::string(to_name(parameters.predictor)) +
                        "' is not one of codec.method '" + std::string(to_name(parameters.method)) + "'");
    }
    if ((parameters.max_error > 0.0 || parameters.max_error_relative > 0.0) && !has_bound(parameters.method))
        return fail(ErrorCode::kUnsupported, "codec.target: codec.method '" +
                                                 std::string(to_name(parameters.method)) +
                                                 "' keeps no bound on vertices; use splitcoder or static");
    if (parameters.max_error > 0.0 && parameters.max_error_relative > 0.0)
        return fail(ErrorCode::kInvalidArgument,
                    "codec.target: max_error and max_error_relative exclude each other");
    return {};
}

}  // namespace batchenc
