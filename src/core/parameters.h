#pragma once

#include <cstdint>
#include <string_view>

#include "core/error.h"

namespace batchenc {

// What a job may choose. The numbers of the enumerations stand in bitstreams and never change.

/// The coder of a clip.
enum class CodecMethod : std::uint8_t {
    kAuto = 0,  ///< in parameters only: RTPCA or, where there is a bound on every vertex and it makes the
                ///< smaller stream, SplitCoder
    kStatic = 1,
    kSplitcoder = 2,
    kRlpca = 3,
    kOrlpca = 4,
    kPdct = 5,
    kRtpca = 6,

    // Baselines (docs/BASELINES.md): what others have published, to be compared with.
    kBaselineStatic = 16,    ///< every frame by itself, parallelogram (Touma and Gotsman 1998)
    kBaselineLpc = 17,       ///< linear prediction along time
    kBaselineDynapack = 18,  ///< extended Lorenzo or Replica (Ibarria and Rossignac 2003)
    kBaselineAngle = 19,     ///< angle-preserving prediction (Stefanoski and Ostermann 2006)
    kBaselinePca = 20,       ///< global PCA after rigid alignment (Alexa and Müller 2000)
    kBaselinePcaLpc = 21,    ///< its coefficients predicted along time (Karni and Gotsman 2004)
    kBaselineCpca = 22,      ///< PCA of clusters found by Lloyd's iterations (Sattler et al. 2005)
    kBaselineCoddyac = 23,   ///< PCA of trajectories, predicted over the mesh (Váša and Skala 2007, 2009)
    kBaselineAffine = 24,    ///< affine motion of clusters and residuals (Lengyel 1999; FAMC)
    kBaselineOctree = 25,    ///< motion vectors of an octree's cells (D3DMC: Müller et al. 2005)
    kBaselineWavelet = 26,   ///< wavelets along time by lifting (Payan and Antonini 2007)
};

/// How the vertices of a clip are divided into clusters (chapter 4).
enum class SegmentationMethod : std::uint8_t {
    kRegionGrowing = 1,
    kClustering = 2,
    kAdaptive = 3,
    kRigid = 4
};

/// Where the principal components of a cluster are taken: in its local coordinate frame (RLPCA) or in the
/// world (LPCA; with one cluster the global PCA).
enum class CoordinateSpace : std::uint8_t { kLocal = 0, kWorld = 1 };

/// How a static mesh's vertices are predicted from their neighbours (chapter 3).
enum class GeometryPredictor : std::uint8_t {
    kAuto = 0,  ///< in parameters only: the one that makes the smallest stream
    kParallelogram = 1,
    kMultiway = 2,
    kLocalParallelogram = 3,
    kLocalMultiway = 4,
    kFitted = 5,
    kToumaGotsman = 6,
    kHope = 7,
    kHopi = 8,
    kHops = 9,
    kWeighted = 10,

    // Of the splitcoder: from the frame before as well (5.4).
    kTime = 11,               ///< local coordinates as in the frame before ("Duplicata")
    kSpace = 12,              ///< parallelogram
    kSpaceMultiway = 13,      ///< mean of parallelograms
    kSpaceTime = 14,          ///< mean of time and parallelogram
    kSpaceTimeMultiway = 15,  ///< mean of time and mean of parallelograms
    kLorenzo = 16,            ///< parallelogram of time differences (extended Lorenzo)
    kLorenzoMultiway = 17,    ///< mean over all gates
    kReplica = 18,            ///< the neighbouring triangle's affine motion along
};

/// How the splitcoder predicts the bending angle at a gate (5.4).
enum class NormalPredictor : std::uint8_t {
    kTime = 0,       ///< as in the frame before
    kSpace = 1,      ///< by the angles decoded nearby in this frame
    kSpaceTime = 2,  ///< mean of both
};

/// How the tangential components are predicted where the bending angle is (3.2.3).
enum class TangentialPredictor : std::uint8_t {
    kParallelogram = 0,
    kMultiway = 1,
    kFitted = 2,    ///< multi-way, corrected as by GeometryPredictor::kFitted
    kWeighted = 3,  ///< weighted by valences as by GeometryPredictor::kWeighted, and corrected
};

/// What a surface is fitted to, where the bending angle is predicted by one (3.3.1). Of single precision, as
/// streams carry it. Defaults of the thesis, which differ between hope and hopi, stand in own_fit().
struct NormalFit {
    std::int32_t vertices = 0;  ///< decoded vertices at most, 3 … 64; 0: the predictor's own number
    float exponent = -1.0f;     ///< weights are distance^-exponent, 0 … 8; -1: the predictor's own
    float cosine = -1.0f;       ///< of the largest angle between normals, 0 … 1; -1: the predictor's own
};

/// Whether a result keeps the order in which the source has its vertices and triangles.
enum class MeshOrder : std::uint8_t {
    kFree = 0,      ///< in the coder's own order, which costs nothing; winding and the count of vertices stay
    kPreserve = 1,  ///< as in the source, each triangle from its first corner on
};

/// Which coefficients of PDCT are coded.
enum class CoefficientAllocation : std::uint8_t {
    kFixed = 0,  ///< of every cluster and frame the same share, the largest (7.3.5)
    kRd = 1,     ///< each as far as the error it takes away is worth its bits
};

/// Along what PDCT transforms.
enum class PdctTransform : std::uint8_t {
    kSpatial = 0,   ///< the vertices of a cluster, frame by frame, each frame from the one before (chapter 7)
    kTemporal = 1,  ///< time as well, a block of frames at once (chapter 9)
};

/// What ORLPCA takes for the rate of a component when it shares components out (6.5).
enum class RateMeasure : std::uint8_t {
    kVectors = 0,  ///< how many numbers it consists of, those of a basis vector and of its coefficients; the
                   ///< thesis counts vectors, whatever their length
    kBits = 1,     ///< the bits that the entropy coder makes of them
};

/// What a job may ask for instead of steps and counts; each is a field of CodecParameters.
enum class CodecTarget : std::uint8_t { kMaxError, kMaxErrorRelative, kKg, kDa, kBpvf, kComponents };
inline constexpr CodecTarget kCodecTargets[] = {CodecTarget::kMaxError, CodecTarget::kMaxErrorRelative,
                                                CodecTarget::kKg,       CodecTarget::kDa,
                                                CodecTarget::kBpvf,     CodecTarget::kComponents};

/// Name as it stands in a job file, such as "rlpca", "clustering", "local"; "unknown" for a number that is
/// none.
std::string_view to_name(CodecMethod method);
std::string_view to_name(SegmentationMethod method);
std::string_view to_name(CoordinateSpace space);
std::string_view to_name(GeometryPredictor predictor);
std::string_view to_name(MeshOrder order);
std::string_view to_name(TangentialPredictor predictor);
std::string_view to_name(CoefficientAllocation allocation);
std::string_view to_name(PdctTransform transform);
std::string_view to_name(NormalPredictor predictor);
std::string_view to_name(RateMeasure rate);
std::string_view to_name(CodecTarget target);  ///< as under codec.target, such as "max_error"

/// Clusters at most where their number is found on the way; what they need is what memory is set aside for.
inline constexpr std::int32_t kMostAutomaticClusters = 1024;

/// Components that orlpca gives a cluster at most where a job file does not say; what they need is what
/// memory is set aside for.
inline constexpr std::int32_t kDefaultMostComponents = 64;

struct SegmentationParameters {
    SegmentationMethod method = SegmentationMethod::kClustering;
    std::int32_t clusters = 20;  ///< wanted number of clusters, 0 … 65535; 0: as many as pay (4.6 with
                                 ///< modelled bits); fewer where there are fewer distinct points
    double threshold = 0.0;      ///< no more clusters than adaptive growth needs to bring the root of the
                                 ///< average deviation (4.7) to this part of e_max, 0 … 1; 0: no such bound
};

struct CodecParameters {
    CodecMethod method = CodecMethod::kRlpca;

    // static, splitcoder, and the first frame of pdct
    std::int32_t bits = 12;  ///< static, splitcoder: no vertex is farther from its source than e_max /
                             ///< 2^bits, 4 … 24 and 4 … 20; pdct: bits of a coefficient over e_max, 4 … 20;
                             ///< baselines: steps are e_max / 2^bits, 4 … 20
    double max_error = 0.0;  ///< static, splitcoder: world units; no vertex is farther from its source than
                             ///< this, whatever the bits; 0: no such target
    double max_error_relative = 0.0;  ///< likewise, as part of the diagonal of the bounding box of the frames
    GeometryPredictor predictor = GeometryPredictor::kAuto;
    TangentialPredictor tangential = TangentialPredictor::kFitted;
    NormalFit fit = {};

    // targets, 0 for none; at most one of them and of max_error and max_error_relative
    double target_kg = 0.0;    ///< orlpca, rtpca: percent; kg is not above it
    double target_da = 0.0;    ///< orlpca, rtpca: percent; da is not above it
    double target_bpvf = 0.0;  ///< orlpca, rtpca: bits a vertex and frame of all that the decoder reads, not
                               ///< exceeded; encode_clip: of the clip's bitstream
    std::int32_t target_components = 0;  ///< orlpca: components of all clusters of a clip together

    // rlpca, orlpca
    CoordinateSpace space = CoordinateSpace::kLocal;
    std::int32_t components =
        20;  ///< principal components a cluster, 1 … 4096; fewer where the rank is lower; orlpca: at most
    std::int32_t basis_bits = 12;        ///< bits of a basis value over its matrix' range, 2 … 20
    std::int32_t coefficient_bits = 12;  ///< bits of a coefficient over its matrix' range, 2 … 20
    std::int32_t frame_bits = 16;  ///< bits of a seed triangle's coordinate over e_max, 4 … 22; pdct too
    RateMeasure rate = RateMeasure::kBits;  ///< orlpca

    // splitcoder
    NormalPredictor normal = NormalPredictor::kTime;

    // baseline-lpc, baseline-pca-lpc
    std::int32_t lpc_order = 2;  ///< frames before that a value is predicted from, 1 … 2

    // rtpca
    double step = 2e-4;  ///< quantisation step of a coefficient over e_max, 1e-7 … 1

    // pdct
    PdctTransform transform = PdctTransform::kSpatial;
    CoefficientAllocation allocation = CoefficientAllocation::kFixed;
    double keep = 1.0;             ///< share of the coefficients that are coded where it is fixed, 0 … 1
    std::int32_t block = 16;       ///< frames that are transformed together along time, 2 … 256
    std::int32_t intra_bits = 12;  ///< bits of a coordinate of a clip's first frame, 4 … 20
};

/// Whether the coder is one of others', for comparisons.
bool is_baseline(CodecMethod method);
/// Whether the coder works on clusters, so that a clip has to be segmented for it.
bool uses_clusters(CodecMethod method);
/// Whether the coder finds out for itself how many clusters pay, where their number is left open.
bool counts_clusters(CodecMethod method);
/// Whether a coder can be given a target.
bool takes_target(CodecMethod method, CodecTarget target);
/// The value of a target, 0 where there is none.
double value_of(const CodecParameters& parameters, CodecTarget target);
/// Whether a coder knows a predictor; every coder knows `auto`.
bool has_predictor(CodecMethod method, GeometryPredictor predictor);
/// Whether a coder describes each clip by components of its own, so that a clip of one kind of motion needs
/// fewer of them.
bool has_components(CodecMethod method);

/// Whether every value is in its range above.
bool is_in_range(const NormalFit& fit);

/// `fit` with what is left to the predictor filled in: hopi 8 vertices, 2.68, 0.9; others 18 vertices, 1.3,
/// 0.5.
NormalFit own_fit(const NormalFit& fit, GeometryPredictor predictor);

/// Whether this build has the coder; the one place that says which numbers of CodecMethod are for later.
bool is_available(CodecMethod method);

/// Refuses parameters outside the ranges above (kInvalidArgument, naming the parameter), and methods that
/// this build does not have (kUnsupported).
Expected<void> check_parameters(const SegmentationParameters& parameters);
Expected<void> check_parameters(const CodecParameters& parameters);
/// The same but for what one parameter asks of another, such as the predictors and targets of a method.
Expected<void> check_values(const CodecParameters& parameters);

}  // namespace batchenc
