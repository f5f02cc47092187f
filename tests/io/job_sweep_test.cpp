#include "io/job/job_sweep.h"

#include <gtest/gtest.h>

#include "io/job_file.h"

namespace batchenc {
namespace {

std::string job_with(const std::string& output, const std::string& sweep) {
    return "batchenc: 1\nname: dance-{components}\ninput: {file: a.h5}\noutput: '" + output +
           "'\nsweep: " + sweep + "\n";
}

Expected<std::vector<Job>> parse(const std::string& output, const std::string& sweep) {
    return parse_job(job_with(output, sweep), "j.yaml");
}

void expect_error(const Expected<std::vector<Job>>& jobs, ErrorCode code, const std::string& where,
                  const std::string& words) {
    ASSERT_FALSE(jobs.has_value());
    EXPECT_EQ(jobs.error().code, code) << jobs.error().to_string();
    EXPECT_EQ(jobs.error().where, "j.yaml:" + where) << jobs.error().to_string();
    EXPECT_NE(jobs.error().message.find(words), std::string::npos) << jobs.error().to_string();
}

TEST(Sweep, LastKeyVariesFastest) {
    const auto jobs = parse("o/{components}_{segmentation.clusters}.h5",
                            "{codec.components: [5, 10, 20], segmentation.clusters: [40, 30]}");
    ASSERT_TRUE(jobs.has_value()) << jobs.error().to_string();
    std::vector<std::string> outputs;
    for (const Job& job : *jobs) outputs.push_back(job.output.string());
    EXPECT_EQ(outputs, (std::vector<std::string>{"o/5_40.h5", "o/5_30.h5", "o/10_40.h5", "o/10_30.h5",
                                                 "o/20_40.h5", "o/20_30.h5"}));
    EXPECT_EQ((*jobs)[3].codec.components, 10);
    EXPECT_EQ((*jobs)[3].segmentation.clusters, 30);
    EXPECT_EQ((*jobs)[3].name, "dance-10");
}

TEST(Sweep, TakesWordsAndOverridesThePlainKey) {
    const auto jobs = parse_job(
        "batchenc: 1\ninput: {file: a.h5}\noutput: '{space}{length}.h5'\ncodec: {space: world}\n"
        "sweep: {codec.space: [local, world], clips.length: [0, 25]}\n",
        "j.yaml");
    ASSERT_TRUE(jobs.has_value()) << jobs.error().to_string();
    ASSERT_EQ(jobs->size(), 4u);
    EXPECT_EQ((*jobs)[0].codec.space, CoordinateSpace::kLocal);
    EXPECT_EQ((*jobs)[1].output, "local25.h5");
    EXPECT_EQ((*jobs)[2].codec.space, CoordinateSpace::kWorld);
    EXPECT_EQ((*jobs)[3].clip_length, 25);
}

TEST(Sweep, EverySweepableKeyHasAPlaceholder) {
    for (const JobKey& key : job_keys()) {
        const auto filled = fill_placeholders("<{" + std::string(key.path) + "}>", JobDraft{});
        ASSERT_EQ(filled.has_value(), key.sweepable) << key.path;
        if (filled) {
            EXPECT_EQ(*filled, "<" + key.show(JobDraft{}) + ">");
        }
    }
}

TEST(Sweep, TakesBothOrders) {
    const auto jobs = parse("o_{order}.h5", "{order: [preserve, free]}");
    ASSERT_TRUE(jobs.has_value()) << jobs.error().to_string();
    ASSERT_EQ(jobs->size(), 2u);
    EXPECT_EQ((*jobs)[0].order, MeshOrder::kPreserve);
    EXPECT_EQ((*jobs)[1].order, MeshOrder::kFree);
    EXPECT_TRUE((*jobs)[1].output.string().ends_with("o_free.h5")) << (*jobs)[1].output;
}

TEST(Sweep, TakesTargets) {
    const auto jobs = parse_job(
        "batchenc: 1\ninput: {file: a.h5}\noutput: 'o_{rate}_{da}.h5'\ncodec: {method: orlpca}\n"
        "sweep: {codec.target.da: [0.05, 1e-3], codec.rate: [bits, vectors]}\n",
        "j.yaml");
    ASSERT_TRUE(jobs.has_value()) << jobs.error().to_string();
    ASSERT_EQ(jobs->size(), 4u);
    EXPECT_EQ((*jobs)[1].output, "o_vectors_0.05.h5");
    EXPECT_EQ((*jobs)[1].codec.rate, RateMeasure::kVectors);
    EXPECT_EQ((*jobs)[2].codec.target_da, 1e-3);
    EXPECT_EQ((*jobs)[2].output, "o_bits_0.001.h5");
}

TEST(Sweep, ShortNameMeansTheKeyOfFewestLevels) {
    JobDraft draft;
    draft.job.codec.components = 7;
    draft.job.codec.target_components = 90;
    EXPECT_EQ(fill_placeholders("{components} {target.components} {codec.target.components}", draft),
              "7 90 90");
}

TEST(Sweep, RefusesMembersWithOneOutput) {
    expect_error(parse("x/../o.h5", "{codec.components: [5, 10]}"), ErrorCode::kInvalidArgument, "4:9",
                 "jobs 1 and 2 of the sweep would write the same output; put {codec.components} into it");
}

TEST(Sweep, RefusesWrongKeys) {
    const auto wrong = ErrorCode::kInvalidArgument;
    expect_error(parse("o", "{codec.componets: [5]}"), wrong, "5:9", "did you mean 'codec.components'?");
    expect_error(parse("o", "{components: [5]}"), wrong, "5:9", "did you mean 'codec.components'?");
    expect_error(parse("o", "{input.file: [a, b]}"), wrong, "5:9", "it takes clips.length");
    expect_error(parse("o", "{codec.components: [1], codec.components: [2]}"), ErrorCode::kFormat, "5:32",
                 "second");
    expect_error(parse("o", "{}"), wrong, "5:8", "mapping of keys to lists");
    expect_error(parse("o", "[5]"), wrong, "5:8", "mapping of keys to lists");
}

TEST(Sweep, RefusesWrongValuesAtTheirPlace) {
    const auto wrong = ErrorCode::kInvalidArgument;
    expect_error(parse("o", "{codec.components: 5}"), wrong, "5:27", "must be a list");
    expect_error(parse("o", "{codec.components: []}"), wrong, "5:27", "must be a list");
    expect_error(parse("o", "{codec.components: [5, 5000]}"), wrong, "5:31", "outside 1 to 4096");
    expect_error(parse("o", "{codec.components: [5, 010]}"), wrong, "5:31", "leading zero");
    expect_error(parse("o", "{codec.components: [5, 6, 5]}"), wrong, "5:34", "twice");
    expect_error(parse("o", "{codec.components: [5, [6]]}"), wrong, "5:31", "holds a list");
    expect_error(parse("o", "{codec.method: [rlpca, lpca]}"), wrong, "5:31", "accepted: rlpca");
}

TEST(Sweep, RefusesWrongPlaceholders) {
    const auto wrong = ErrorCode::kInvalidArgument;
    const std::string one = "{codec.components: [5]}";
    expect_error(parse("o{compnents}", one), wrong, "4:9", "'compnents'");
    expect_error(parse("o{method}", one), wrong, "4:9", "{segmentation.method} or {codec.method}");
    expect_error(parse("o{}", one), wrong, "4:9", "takes one of");
    expect_error(parse("o{components", one), wrong, "4:9", "partner");
    expect_error(parse("ocomponents}", one), wrong, "4:9", "partner");
    expect_error(parse("{{components}}", one), wrong, "4:9", "partner");
}

TEST(Sweep, StopsAtItsLimit) {
    std::string hundred, one_more;
    for (int i = 1; i <= 100; ++i) hundred += (i > 1 ? ", " : "") + std::to_string(i);
    one_more = hundred + ", 101";
    const std::string output = "o{components}_{clusters}.h5";
    const auto jobs =
        parse(output, "{codec.components: [" + hundred + "], segmentation.clusters: [" + hundred + "]}");
    ASSERT_TRUE(jobs.has_value()) << jobs.error().to_string();
    EXPECT_EQ(jobs->size(), 10000u);
    expect_error(
        parse(output, "{codec.components: [" + hundred + "], segmentation.clusters: [" + one_more + "]}"),
        ErrorCode::kLimit, "5:8", "10000");
}

}  // namespace
}  // namespace batchenc
