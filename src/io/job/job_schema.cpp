#include "io/job/job_schema.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <vector>

#include "io/source_clip.h"

namespace batchenc {
namespace {

using Words = std::array<std::string_view, 1>;
constexpr std::array<std::string_view, 2> kOrders = {"preserve", "free"};
constexpr Words kLengthWords = {"auto"};
constexpr std::array<std::string_view, 4> kSegmentationMethods = {"region-growing", "clustering", "adaptive",
                                                                  "rigid"};
constexpr std::array<std::string_view, 18> kCodecMethods = {"rlpca",
                                                            "orlpca",
                                                            "pdct",
                                                            "rtpca",
                                                            "auto",
                                                            "splitcoder",
                                                            "static",
                                                            "baseline-static",
                                                            "baseline-lpc",
                                                            "baseline-dynapack",
                                                            "baseline-angle",
                                                            "baseline-pca",
                                                            "baseline-pca-lpc",
                                                            "baseline-cpca",
                                                            "baseline-coddyac",
                                                            "baseline-affine",
                                                            "baseline-octree",
                                                            "baseline-wavelet"};
constexpr std::array<std::string_view, 19> kPredictors = {"auto",           "parallelogram",
                                                          "multiway",       "local-parallelogram",
                                                          "local-multiway", "weighted",
                                                          "fitted",         "touma-gotsman",
                                                          "hope",           "hopi",
                                                          "hops",           "time",
                                                          "space",          "space-multiway",
                                                          "space-time",     "space-time-multiway",
                                                          "lorenzo",        "lorenzo-multiway",
                                                          "replica"};
constexpr std::array<std::string_view, 3> kNormals = {"time", "space", "space-time"};
constexpr std::array<std::string_view, 4> kTangentials = {"fitted", "weighted", "multiway", "parallelogram"};
constexpr std::array<std::string_view, 2> kTransforms = {"spatial", "temporal"};
constexpr std::array<std::string_view, 2> kAllocations = {"fixed", "rd"};
constexpr std::array<std::string_view, 2> kRates = {"bits", "vectors"};
constexpr std::array<std::string_view, 2> kSpaces = {"local", "world"};

/// The value of an enumeration whose name is `name`; the words of a kChoice key are tested to be such names.
template <typename Enum>
Enum from_name(std::string_view name) {
    for (int number = 0; number < 256; ++number) {
        if (to_name(static_cast<Enum>(number)) == name) return static_cast<Enum>(number);
    }
    return Enum{};
}

std::int32_t narrow(std::int64_t value) { return static_cast<std::int32_t>(value); }

/// The shortest decimal number that reads back as the same.
template <typename Float>
std::string shown(Float value) {
    char text[32];
    return {text, std::to_chars(text, text + sizeof(text), value).ptr};
}

std::string show_frames(const JobDraft& draft) {
    const std::string end = draft.job.frame_end ? std::to_string(*draft.job.frame_end) : "end";
    return "[" + std::to_string(draft.job.frame_begin) + ", " + end + "]";
}

JobKey mapping(std::string_view path, std::string_view sentence) {
    return {.path = path, .type = JobKeyType::kMapping, .sentence = sentence};
}

std::vector<JobKey> make_keys() {
    using enum JobKeyType;
    std::vector<JobKey> keys;
    keys.push_back({.path = "batchenc",
                    .type = kInteger,
                    .sentence = "version of this schema",
                    .low = 1,
                    .high = 1,
                    .required = true,
                    .assign = [](JobDraft&, const JobValue&) {},
                    .show = [](const JobDraft&) { return std::string("1"); }});
    keys.push_back(
        {.path = "name",
         .type = kText,
         .sentence = "what logs and tables call the job; the file's name without extension when absent",
         .assign = [](JobDraft& d, const JobValue& v) { d.job.name = v.text; },
         .show = [](const JobDraft& d) { return quoted_yaml(d.job.name); }});

    keys.push_back(mapping("input", "the source clip"));
    keys.back().required = true;
    keys.push_back({.path = "input.file",
                    .type = kPath,
                    .sentence = "HDF5 file to encode",
                    .required = true,
                    .assign = [](JobDraft& d, const JobValue& v) { d.input_text = v.text; },
                    .show = [](const JobDraft& d) { return quoted_yaml(d.input_text); }});
    keys.push_back({.path = "input.positions",
                    .type = kDataset,
                    .sentence = "dataset of the positions, [frame][vertex][xyz]",
                    .assign = [](JobDraft& d, const JobValue& v) { d.job.positions = v.text; },
                    .show = [](const JobDraft& d) { return quoted_yaml(d.job.positions); }});
    keys.push_back({.path = "input.triangles",
                    .type = kDataset,
                    .sentence = "dataset of the triangles, [triangle][corner]; points have none",
                    .assign = [](JobDraft& d, const JobValue& v) { d.job.triangles = v.text; },
                    .show = [](const JobDraft& d) { return quoted_yaml(d.job.triangles); }});
    keys.push_back({.path = "input.frames",
                    .type = kFrames,
                    .sentence = "frames to encode, first and one past the last, counted from 0",
                    .assign =
                        [](JobDraft& d, const JobValue& v) {
                            d.job.frame_begin = v.integer;
                            d.job.frame_end = v.end;
                        },
                    .show = show_frames});

    keys.push_back({.path = "output",
                    .type = kPath,
                    .sentence = "result file; takes {components} and the like from a sweep",
                    .required = true,
                    .assign = [](JobDraft& d, const JobValue& v) { d.output_text = v.text; },
                    .show = [](const JobDraft& d) { return quoted_yaml(d.output_text); }});

    keys.push_back(mapping("clips", "how a long sequence is cut into clips that decode on their own"));
    keys.push_back({.path = "clips.length",
                    .type = kInteger,
                    .sentence = "frames a clip; 0 is the whole sequence, auto cuts where the motion changes",
                    .low = 0,
                    .high = SourceLimits{}.max_frames,
                    .words = kLengthWords,
                    .sweepable = true,
                    .assign =
                        [](JobDraft& d, const JobValue& v) {
                            d.job.clip_length = v.text.empty() ? v.integer : kAutomaticClips;
                        },
                    .show =
                        [](const JobDraft& d) {
                            return d.job.clip_length == kAutomaticClips ? std::string(kLengthWords.front())
                                                                        : std::to_string(d.job.clip_length);
                        }});
    keys.push_back(
        {.path = "order",
         .type = kChoice,
         .sentence = "whether vertices and triangles come back in their order",
         .words = kOrders,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.order = from_name<MeshOrder>(v.text); },
         .show = [](const JobDraft& d) { return std::string(to_name(d.job.order)); }});

    keys.push_back(mapping("segmentation", "how vertices are grouped into clusters that move together"));
    keys.push_back(
        {.path = "segmentation.method",
         .type = kChoice,
         .sentence = "how clusters are found",
         .words = kSegmentationMethods,
         .sweepable = true,
         .assign =
             [](JobDraft& d, const JobValue& v) {
                 d.job.segmentation.method = from_name<SegmentationMethod>(v.text);
             },
         .show = [](const JobDraft& d) { return std::string(to_name(d.job.segmentation.method)); }});
    keys.push_back(
        {.path = "segmentation.clusters",
         .type = kInteger,
         .sentence = "clusters wanted, or 0 for as many as pay; fewer where no more are of use",
         .low = 0,
         .high = 65535,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.segmentation.clusters = narrow(v.integer); },
         .show = [](const JobDraft& d) { return std::to_string(d.job.segmentation.clusters); }});

    keys.push_back(
        {.path = "segmentation.threshold",
         .type = kNumber,
         .sentence = "no more clusters than bring the average step to this part of e_max; 0 is no bound",
         .low = 0,
         .high = 1,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.segmentation.threshold = v.number; },
         .show = [](const JobDraft& d) { return shown(d.job.segmentation.threshold); }});

    keys.push_back(mapping("codec", "how each cluster is coded"));
    keys.push_back({.path = "codec.method",
                    .type = kChoice,
                    .sentence = "the coder",
                    .words = kCodecMethods,
                    .sweepable = true,
                    .assign = [](JobDraft& d,
                                 const JobValue& v) { d.job.codec.method = from_name<CodecMethod>(v.text); },
                    .show = [](const JobDraft& d) { return std::string(to_name(d.job.codec.method)); }});
    keys.push_back(
        {.path = "codec.bits",
         .type = kInteger,
         .sentence =
             "static, splitcoder: no vertex is off by more than e_max / 2^bits; pdct, baselines: steps "
             "are e_max / 2^bits; all but static up to 20",
         .low = 4,
         .high = 24,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.bits = narrow(v.integer); },
         .show = [](const JobDraft& d) { return std::to_string(d.job.codec.bits); }});
    keys.push_back(
        {.path = "codec.predictor",
         .type = kChoice,
         .sentence = "static, first frames of pdct, baseline-dynapack (lorenzo, replica), splitcoder "
                     "(fitted, local-multiway and those from time on): how "
                     "a vertex is predicted; auto takes what makes the stream smallest",
         .words = kPredictors,
         .sweepable = true,
         .assign = [](JobDraft& d,
                      const JobValue& v) { d.job.codec.predictor = from_name<GeometryPredictor>(v.text); },
         .show = [](const JobDraft& d) { return std::string(to_name(d.job.codec.predictor)); }});
    keys.push_back(
        {.path = "codec.tangential",
         .type = kChoice,
         .sentence =
             "touma-gotsman, hope, hopi, hops: how the tangential components are predicted; auto tries all",
         .words = kTangentials,
         .sweepable = true,
         .assign = [](JobDraft& d,
                      const JobValue& v) { d.job.codec.tangential = from_name<TangentialPredictor>(v.text); },
         .show = [](const JobDraft& d) { return std::string(to_name(d.job.codec.tangential)); }});
    keys.push_back(
        {.path = "codec.normal",
         .type = kChoice,
         .sentence = "splitcoder, time, space and the like: how the bending angle is predicted",
         .words = kNormals,
         .sweepable = true,
         .assign = [](JobDraft& d,
                      const JobValue& v) { d.job.codec.normal = from_name<NormalPredictor>(v.text); },
         .show = [](const JobDraft& d) { return std::string(to_name(d.job.codec.normal)); }});
    keys.push_back(
        {.path = "codec.fit_vertices",
         .type = kInteger,
         .sentence = "hope, hopi: vertices that a surface is fitted to, at most, from 3; 0 is the "
                     "predictor's own (18, 8)",
         .low = 0,
         .high = 64,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.fit.vertices = narrow(v.integer); },
         .show = [](const JobDraft& d) { return std::to_string(d.job.codec.fit.vertices); }});
    keys.push_back(
        {.path = "codec.fit_exponent",
         .type = kNumber,
         .sentence =
             "hope, hopi: weights are distance to minus this, from 0; -1 is the predictor's own (1.3, 2.68)",
         .low = -1,
         .high = 8,
         .sweepable = true,
         .assign = [](JobDraft& d,
                      const JobValue& v) { d.job.codec.fit.exponent = static_cast<float>(v.number); },
         .show = [](const JobDraft& d) { return shown(d.job.codec.fit.exponent); }});
    keys.push_back(
        {.path = "codec.fit_cosine",
         .type = kNumber,
         .sentence = "hope, hopi, hops: least cosine between normals of triangles that count, "
                     "from 0; -1 is the predictor's own (0.5, 0.9, 0.5)",
         .low = -1,
         .high = 1,
         .sweepable = true,
         .assign = [](JobDraft& d,
                      const JobValue& v) { d.job.codec.fit.cosine = static_cast<float>(v.number); },
         .show = [](const JobDraft& d) { return shown(d.job.codec.fit.cosine); }});
    keys.push_back(
        {.path = "codec.space",
         .type = kChoice,
         .sentence = "rlpca, orlpca: coordinates in which components are taken: each cluster's own frame, or "
                     "the world",
         .words = kSpaces,
         .sweepable = true,
         .assign = [](JobDraft& d,
                      const JobValue& v) { d.job.codec.space = from_name<CoordinateSpace>(v.text); },
         .show = [](const JobDraft& d) { return std::string(to_name(d.job.codec.space)); }});
    keys.push_back(
        {.path = "codec.components",
         .type = kInteger,
         .sentence = "principal components a cluster, of baselines without clusters in all; rlpca: fewer "
                     "where the rank is lower; orlpca: at most, "
                     "64 where the key is absent",
         .low = 1,
         .high = 4096,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.components = narrow(v.integer); },
         .show = [](const JobDraft& d) { return std::to_string(d.job.codec.components); }});
    keys.push_back(
        {.path = "codec.basis_bits",
         .type = kInteger,
         .sentence = "rlpca, orlpca, baselines by PCA: bits of a basis value over the range of its matrix",
         .low = 2,
         .high = 20,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.basis_bits = narrow(v.integer); },
         .show = [](const JobDraft& d) { return std::to_string(d.job.codec.basis_bits); }});
    keys.push_back(
        {.path = "codec.coefficient_bits",
         .type = kInteger,
         .sentence = "rlpca, orlpca, baselines by PCA: bits of a coefficient over the range of its matrix",
         .low = 2,
         .high = 20,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.coefficient_bits = narrow(v.integer); },
         .show = [](const JobDraft& d) { return std::to_string(d.job.codec.coefficient_bits); }});
    keys.push_back(
        {.path = "codec.frame_bits",
         .type = kInteger,
         .sentence = "rlpca, orlpca, pdct: bits of a seed triangle's coordinate over the clip's largest side",
         .low = 4,
         .high = 22,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.frame_bits = narrow(v.integer); },
         .show = [](const JobDraft& d) { return std::to_string(d.job.codec.frame_bits); }});
    keys.push_back(
        {.path = "codec.rate",
         .type = kChoice,
         .sentence = "orlpca: what a component costs: its bits as coded, or its count of numbers",
         .words = kRates,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.rate = from_name<RateMeasure>(v.text); },
         .show = [](const JobDraft& d) { return std::string(to_name(d.job.codec.rate)); }});
    keys.push_back(
        {.path = "codec.lpc_order",
         .type = kInteger,
         .sentence = "baseline-lpc, baseline-pca-lpc: frames before that a value is predicted from",
         .low = 1,
         .high = 2,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.lpc_order = narrow(v.integer); },
         .show = [](const JobDraft& d) { return std::to_string(d.job.codec.lpc_order); }});
    keys.push_back({.path = "codec.step",
                    .type = kNumber,
                    .sentence = "rtpca: quantisation step of a coefficient over e_max, from 1e-7",
                    .low = 0,
                    .high = 1,
                    .sweepable = true,
                    .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.step = v.number; },
                    .show = [](const JobDraft& d) { return shown(d.job.codec.step); }});
    keys.push_back(
        {.path = "codec.transform",
         .type = kChoice,
         .sentence = "pdct: what is transformed: vertices frame by frame, or time as well, a block at once",
         .words = kTransforms,
         .sweepable = true,
         .assign = [](JobDraft& d,
                      const JobValue& v) { d.job.codec.transform = from_name<PdctTransform>(v.text); },
         .show = [](const JobDraft& d) { return std::string(to_name(d.job.codec.transform)); }});
    keys.push_back(
        {.path = "codec.allocation",
         .type = kChoice,
         .sentence = "pdct: which coefficients are coded: a fixed share, or those that are worth their bits",
         .words = kAllocations,
         .sweepable = true,
         .assign =
             [](JobDraft& d, const JobValue& v) {
                 d.job.codec.allocation = from_name<CoefficientAllocation>(v.text);
             },
         .show = [](const JobDraft& d) { return std::string(to_name(d.job.codec.allocation)); }});
    keys.push_back({.path = "codec.keep",
                    .type = kNumber,
                    .sentence = "pdct, fixed: share of a cluster's coefficients that are coded, the largest",
                    .low = 0,
                    .high = 1,
                    .sweepable = true,
                    .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.keep = v.number; },
                    .show = [](const JobDraft& d) { return shown(d.job.codec.keep); }});
    keys.push_back({.path = "codec.block",
                    .type = kInteger,
                    .sentence = "pdct, temporal: frames that are transformed together",
                    .low = 2,
                    .high = 256,
                    .sweepable = true,
                    .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.block = narrow(v.integer); },
                    .show = [](const JobDraft& d) { return std::to_string(d.job.codec.block); }});
    keys.push_back(
        {.path = "codec.intra_bits",
         .type = kInteger,
         .sentence = "pdct: bits of a clip's first frame, as bits of the static coder",
         .low = 4,
         .high = 20,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.intra_bits = narrow(v.integer); },
         .show = [](const JobDraft& d) { return std::to_string(d.job.codec.intra_bits); }});
    keys.push_back(mapping("codec.target",
                           "lets the coder choose its steps for a wanted error or size; one key of these"));
    keys.push_back({.path = "codec.target.max_error",
                    .type = kNumber,
                    .sentence =
                        "static, splitcoder, rtpca: largest distance of a vertex from its source, world "
                        "units, whatever the bits; 0 is no target",
                    .low = 0,
                    .high = 1000000000,
                    .sweepable = true,
                    .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.max_error = v.number; },
                    .show = [](const JobDraft& d) { return shown(d.job.codec.max_error); }});
    keys.push_back(
        {.path = "codec.target.max_error_relative",
         .type = kNumber,
         .sentence = "likewise, over the diagonal of the bounding box of all frames; 0 is no target",
         .low = 0,
         .high = 1,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.max_error_relative = v.number; },
         .show = [](const JobDraft& d) { return shown(d.job.codec.max_error_relative); }});

    keys.push_back({.path = "codec.target.kg",
                    .type = kNumber,
                    .sentence = "orlpca, rtpca: largest error of Karni and Gotsman, percent; 0 is no target",
                    .low = 0,
                    .high = 1000,
                    .sweepable = true,
                    .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.target_kg = v.number; },
                    .show = [](const JobDraft& d) { return shown(d.job.codec.target_kg); }});
    keys.push_back({.path = "codec.target.da",
                    .type = kNumber,
                    .sentence = "orlpca, rtpca: largest error of the thesis, percent; 0 is no target",
                    .low = 0,
                    .high = 1000,
                    .sweepable = true,
                    .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.target_da = v.number; },
                    .show = [](const JobDraft& d) { return shown(d.job.codec.target_da); }});
    keys.push_back({.path = "codec.target.bpvf",
                    .type = kNumber,
                    .sentence = "orlpca, rtpca: most bits a vertex and frame, of all that a decoder reads; "
                                "0 is no target",
                    .low = 0,
                    .high = 1000,
                    .sweepable = true,
                    .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.target_bpvf = v.number; },
                    .show = [](const JobDraft& d) { return shown(d.job.codec.target_bpvf); }});
    keys.push_back(
        {.path = "codec.target.components",
         .type = kInteger,
         .sentence = "orlpca: most components over all clusters of a clip together; 0 is no target",
         .low = 0,
         .high = 65535 * 4096,
         .sweepable = true,
         .assign = [](JobDraft& d, const JobValue& v) { d.job.codec.target_components = narrow(v.integer); },
         .show = [](const JobDraft& d) { return std::to_string(d.job.codec.target_components); }});

    keys.push_back(
        {.path = "analysis",
         .type = kBoolean,
         .sentence = "write labels and vertex errors for analysis tools beside the bitstream",
         .assign = [](JobDraft& d, const JobValue& v) { d.job.analysis = v.integer != 0; },
         .show = [](const JobDraft& d) { return std::string(d.job.analysis ? "true" : "false"); }});
    keys.push_back({.path = "sweep",
                    .type = kSweep,
                    .sentence = "lists of values for dotted keys; one job for every combination"});
    return keys;
}

std::string_view parent_of(std::string_view path) {
    const std::size_t dot = path.rfind('.');
    return dot == std::string_view::npos ? std::string_view() : path.substr(0, dot);
}

std::string_view last_of(std::string_view path) {
    const std::size_t dot = path.rfind('.');
    return dot == std::string_view::npos ? path : path.substr(dot + 1);
}

/// Insertions, deletions, substitutions and exchanges of neighbours that make one word the other.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before(b.size() + 1), previous(b.size() + 1), row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        before.swap(previous);
        previous.swap(row);
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({previous[j] + 1, row[j - 1] + 1, previous[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
                row[j] = std::min(row[j], before[j - 2] + 1);
            }
        }
    }
    return row[b.size()];
}

std::string in_lower_case(std::string_view text) {
    std::string lower(text);
    for (char& c : lower) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
        if (c == '-') c = '_';  // the commonest slip besides case
    }
    return lower;
}

}  // namespace

std::span<const JobKey> job_keys() {
    static const std::vector<JobKey> keys = make_keys();
    return keys;
}

const JobKey* find_job_key(std::string_view path) {
    const auto keys = job_keys();
    const auto found =
        std::find_if(keys.begin(), keys.end(), [&](const JobKey& key) { return key.path == path; });
    return found == keys.end() ? nullptr : &*found;
}

std::string_view nearest_word(std::string_view word, std::span<const std::string_view> words) {
    constexpr std::size_t kLongest = 40;  // longer words are no slip, and the comparison stays cheap
    if (word.size() > kLongest) return {};
    const std::string lower = in_lower_case(word);
    std::string_view best;
    std::size_t best_distance = std::max<std::size_t>(1, word.size() / 3) + 1;
    for (const std::string_view candidate : words) {
        const std::size_t distance = edit_distance(lower, in_lower_case(candidate));
        if (distance < best_distance) {
            best = candidate;
            best_distance = distance;
        }
    }
    return best;
}

std::string suggest_key(std::string_view parent, std::string_view key) {
    std::vector<std::string_view> siblings;
    for (const JobKey& known : job_keys()) {
        if (parent_of(known.path) == parent) siblings.push_back(last_of(known.path));
    }
    if (const std::string_view near = nearest_word(key, siblings); !near.empty()) {
        return "did you mean '" + std::string(near) + "'?";
    }
    const std::string_view wanted = last_of(key);
    for (const JobKey& known : job_keys()) {
        if (last_of(known.path) != wanted || known.path == wanted) continue;
        return "'" + std::string(wanted) + "' belongs under '" + std::string(parent_of(known.path)) + "'";
    }
    if (find_job_key(key)) return "'" + std::string(key) + "' stands at the top of the file";
    return {};
}

std::string quoted_yaml(std::string_view text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') quoted += '\\';
        quoted += c;
    }
    return quoted + "\"";
}

}  // namespace batchenc
