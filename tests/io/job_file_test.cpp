#include "io/job_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "io/job/job_schema.h"

namespace batchenc {
namespace {

const std::filesystem::path kPath = "jobs/dance.yaml";
const std::string kShortest = "batchenc: 1\ninput: {file: a.h5}\noutput: b.h5\n";

std::vector<Job> parse_well(const std::string& text) {
    auto jobs = parse_job(text, kPath);
    if (!jobs) {
        ADD_FAILURE() << jobs.error().to_string() << "\n" << text;
        return {Job{}};
    }
    return *jobs;
}

void expect_same(const Job& a, const Job& b) {
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.file, b.file);
    EXPECT_EQ(a.input, b.input);
    EXPECT_EQ(a.positions, b.positions);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.frame_begin, b.frame_begin);
    EXPECT_EQ(a.frame_end, b.frame_end);
    EXPECT_EQ(a.output, b.output);
    EXPECT_EQ(a.clip_length, b.clip_length);
    EXPECT_EQ(a.segmentation.method, b.segmentation.method);
    EXPECT_EQ(a.segmentation.clusters, b.segmentation.clusters);
    EXPECT_EQ(a.segmentation.threshold, b.segmentation.threshold);
    EXPECT_EQ(a.codec.method, b.codec.method);
    EXPECT_EQ(a.codec.bits, b.codec.bits);
    EXPECT_EQ(a.codec.predictor, b.codec.predictor);
    EXPECT_EQ(a.codec.space, b.codec.space);
    EXPECT_EQ(a.codec.components, b.codec.components);
    EXPECT_EQ(a.codec.basis_bits, b.codec.basis_bits);
    EXPECT_EQ(a.codec.coefficient_bits, b.codec.coefficient_bits);
    EXPECT_EQ(a.codec.frame_bits, b.codec.frame_bits);
    EXPECT_EQ(a.codec.rate, b.codec.rate);
    EXPECT_EQ(a.codec.step, b.codec.step);
    for (const CodecTarget target : kCodecTargets)
        EXPECT_EQ(value_of(a.codec, target), value_of(b.codec, target)) << to_name(target);
    EXPECT_EQ(a.order, b.order);
    EXPECT_EQ(a.analysis, b.analysis);
    EXPECT_EQ(a.yaml, b.yaml);
}

TEST(JobFile, ReadsEveryKey) {
    const auto jobs = parse_well(
        "batchenc: 1\n"
        "name: dance\n"
        "input:  {file: ../data/dance.h5, positions: /p, triangles: /mesh/t, frames: [3, 201]}\n"
        "output: out/dance.h5\n"
        "clips:  {length: 64}\n"
        "order:  free\n"
        "segmentation: {method: adaptive, clusters: 7, threshold: 2.5e-4}\n"
        "codec:  {method: rlpca, space: world, components: 8, basis_bits: 9, coefficient_bits: 10, "
        "frame_bits: 11}\n"
        "analysis: false\n");
    ASSERT_EQ(jobs.size(), 1u);
    const Job& job = jobs[0];
    EXPECT_EQ(job.name, "dance");
    EXPECT_EQ(job.file, kPath);
    EXPECT_EQ(job.input, "jobs/../data/dance.h5");
    EXPECT_EQ(job.positions, "/p");
    EXPECT_EQ(job.triangles, "/mesh/t");
    EXPECT_EQ(job.frame_begin, 3);
    EXPECT_EQ(job.frame_end, 201);
    EXPECT_EQ(job.output, "jobs/out/dance.h5");
    EXPECT_EQ(job.clip_length, 64);
    EXPECT_EQ(job.order, MeshOrder::kFree);
    EXPECT_EQ(job.segmentation.method, SegmentationMethod::kAdaptive);
    EXPECT_EQ(job.segmentation.clusters, 7);
    EXPECT_EQ(job.segmentation.threshold, 2.5e-4);
    EXPECT_EQ(job.codec.space, CoordinateSpace::kWorld);
    EXPECT_EQ(job.codec.components, 8);
    EXPECT_EQ(job.codec.basis_bits, 9);
    EXPECT_EQ(job.codec.coefficient_bits, 10);
    EXPECT_EQ(job.codec.frame_bits, 11);
    EXPECT_FALSE(job.analysis);
}

TEST(JobFile, FillsInDefaults) {
    const Job job = parse_well(kShortest)[0];
    Job expected;
    expected.name = "dance";
    expected.file = kPath;
    expected.input = "jobs/a.h5";
    expected.output = "jobs/b.h5";
    expected.yaml = job.yaml;
    expect_same(job, expected);
}

TEST(JobFile, ReadsBothOrders) {
    for (const MeshOrder order : {MeshOrder::kPreserve, MeshOrder::kFree}) {
        const std::string word(to_name(order));
        const Job job = parse_well(kShortest + "order: " + word + "\n")[0];
        EXPECT_EQ(job.order, order);
        EXPECT_NE(job.yaml.find("order: " + word), std::string::npos) << job.yaml;
        EXPECT_EQ(parse_well(job.yaml)[0].order, order);
    }
    EXPECT_EQ(parse_well(kShortest)[0].order, MeshOrder::kPreserve);
    EXPECT_EQ(to_name(static_cast<MeshOrder>(2)), "unknown");
}

TEST(JobFile, ReadsAutomaticClips) {
    const Job job = parse_well(kShortest + "clips: {length: auto}\n")[0];
    EXPECT_EQ(job.clip_length, kAutomaticClips);
    EXPECT_NE(job.yaml.find("length: auto"), std::string::npos) << job.yaml;
    EXPECT_EQ(parse_well(job.yaml)[0].clip_length, kAutomaticClips);
    EXPECT_EQ(parse_well(kShortest + "clips: {length: 0}\n")[0].clip_length, 0);
    const auto swept = parse_well(
        "batchenc: 1\ninput: {file: a.h5}\noutput: b-{length}.h5\n"
        "sweep: {clips.length: [auto, 64]}\n");
    ASSERT_EQ(swept.size(), 2U);
    EXPECT_EQ(swept[0].output, "jobs/b-auto.h5");
    EXPECT_EQ(swept[1].clip_length, 64);
}

TEST(JobFile, KeepsAbsolutePaths) {
    const Job job = parse_well("batchenc: 1\ninput: {file: /a/b.h5}\noutput: /c.h5\n")[0];
    EXPECT_EQ(job.input, "/a/b.h5");
    EXPECT_EQ(job.output, "/c.h5");
}

TEST(JobFile, ReadsOpenFrameRange) {
    const Job job = parse_well("batchenc: 1\ninput: {file: a.h5, frames: [10, end]}\noutput: b.h5\n")[0];
    EXPECT_EQ(job.frame_begin, 10);
    EXPECT_FALSE(job.frame_end.has_value());
}

TEST(JobFile, SpelledOutJobGivesTheSameJobAgain) {
    const std::string sources[] = {
        kShortest,
        "batchenc: 1\nname: \"Größe \\\"2\\\" \\\\o {clusters}\"\ninput: {file: 'a # \"b\".h5', frames: [5, "
        "6]}\n"
        "output: '[{codec.method}] {space}.h5'\nanalysis: false\nclips: {length: 12}\norder: free\n"
        "segmentation: {method: rigid, clusters: 0, threshold: 0.1}\n"
        "codec: {space: world, components: 4096, basis_bits: 2, coefficient_bits: 20, frame_bits: 22}\n",
        kShortest + "name: 'x{components}'\nsweep: {codec.components: [3, 4]}\n",
        kShortest + "codec: {method: orlpca, rate: vectors, step: 1e-5, target: {bpvf: 2.25}}\n",
        kShortest + "codec: {method: orlpca, target: {components: 300}}\n",
    };
    for (std::string text : sources) {
        const bool sweep = text.find("sweep") != std::string::npos;
        if (sweep) text.replace(text.find("b.h5"), 4, "b{components}.h5");
        if (text.find("\\\\o") != std::string::npos) text.replace(text.find("\\\\o"), 3, "");
        const auto jobs = parse_well(text);
        EXPECT_EQ(jobs.size(), sweep ? 2u : 1u);
        for (const Job& job : jobs) {
            const auto again = parse_well(job.yaml);
            ASSERT_EQ(again.size(), 1u) << job.yaml;
            expect_same(job, again[0]);
        }
    }
}

TEST(JobFile, OrlpcaMayHaveMoreComponentsWhereTheFileDoesNotSay) {
    const std::string orlpca = "codec: {method: orlpca, target: {da: 0.1}";
    const Job job = parse_well(kShortest + orlpca + "}\n")[0];
    EXPECT_EQ(job.codec.components, kDefaultMostComponents);
    EXPECT_EQ(parse_well(job.yaml)[0].codec.components, kDefaultMostComponents);
    EXPECT_EQ(parse_well(kShortest + orlpca + ", components: 20}\n")[0].codec.components, 20);
    EXPECT_EQ(parse_well("batchenc: 1\ninput: {file: a.h5}\noutput: b{components}.h5\n" + orlpca +
                         "}\nsweep: {codec.components: [20, 30]}\n")[1]
                  .codec.components,
              30);
    EXPECT_EQ(parse_well(kShortest)[0].codec.components, 20);
}

TEST(JobFile, SpelledOutJobHasEveryKey) {
    const std::string yaml = parse_well(kShortest)[0].yaml;
    for (const JobKey& key : job_keys()) {
        const std::string word(key.path.substr(key.path.rfind('.') + 1));
        const bool expected = key.type != JobKeyType::kSweep;
        EXPECT_EQ(yaml.find(word + ":") != std::string::npos, expected) << key.path;
    }
}

TEST(JobFile, AcceptsLineEndsOfWindowsAndByteOrderMark) {
    std::string text = "\xEF\xBB\xBF";
    for (const char c : kShortest) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
    expect_same(parse_well(text)[0], parse_well(kShortest)[0]);
}

TEST(JobSchema, RangesAgreeWithCheckParameters) {
    const auto accepted = [](const JobKey& key, std::int64_t value) {
        JobDraft draft;
        if (key.path.starts_with("codec.target.")) {
            draft.job.codec.method = CodecMethod::kOrlpca;
            draft.job.codec.target_kg = value > 0 ? 0.0 : 1.0;
        }
        key.assign(draft, JobValue{.integer = value, .number = 0.0, .end = {}, .text = {}});
        return check_parameters(draft.job.segmentation).has_value() &&
               check_parameters(draft.job.codec).has_value();
    };
    int tested = 0;
    for (const JobKey& key : job_keys()) {
        if (key.type != JobKeyType::kInteger || !key.sweepable || key.path == "clips.length") continue;
        EXPECT_TRUE(accepted(key, key.low)) << key.path;
        EXPECT_TRUE(accepted(key, key.high)) << key.path;
        EXPECT_FALSE(accepted(key, key.low - 1)) << key.path;
        EXPECT_FALSE(accepted(key, key.high + 1)) << key.path;
        ++tested;
    }
    EXPECT_EQ(tested, 11);
}

TEST(JobSchema, WordsAgreeWithCheckParameters) {
    const auto check = [](const JobKey& key, std::string_view word) {
        JobDraft draft;
        key.assign(draft, JobValue{.integer = 0, .number = 0.0, .end = {}, .text = std::string(word)});
        EXPECT_EQ(key.show(draft), word) << key.path << " does not know the word";
        return check_parameters(draft.job.segmentation).and_then([&] {
            return check_values(draft.job.codec);
        });
    };
    for (const char* path :
         {"segmentation.method", "codec.method", "codec.space", "codec.predictor", "codec.tangential",
          "codec.normal", "codec.transform", "codec.allocation", "codec.rate"}) {
        const JobKey& key = *find_job_key(path);
        for (const auto word : key.words) EXPECT_TRUE(check(key, word).has_value()) << path << " " << word;
    }
    std::set<std::string_view> methods;
    for (int i = 0; i < 256; ++i) methods.insert(to_name(static_cast<CodecMethod>(i)));
    const JobKey& method = *find_job_key("codec.method");
    EXPECT_EQ(methods.size(), method.words.size() + 1) << "+ 1 is unknown";
}

TEST(JobSchema, HelpNamesEveryKeyRangeAndDefault) {
    const std::string help = job_help();
    std::string unwrapped = help;
    const std::string indent = "\n" + std::string(28, ' ');
    for (std::size_t at = 0; (at = unwrapped.find(indent, at)) != std::string::npos;)
        unwrapped.replace(at, indent.size(), " ");
    for (const JobKey& key : job_keys()) {
        const std::size_t at = unwrapped.find(" " + std::string(key.path) + "  ");
        ASSERT_NE(at, std::string::npos) << key.path;
        const std::string entry = unwrapped.substr(at, unwrapped.find('\n', at) - at);
        EXPECT_NE(entry.find(describe_range(key)), std::string::npos) << entry;
        EXPECT_NE(entry.find(describe_default(key)), std::string::npos) << entry;
        EXPECT_NE(entry.find(key.sentence), std::string::npos) << entry;
    }
    for (std::size_t at = 0; at < help.size(); at = help.find('\n', at) + 1) {
        EXPECT_LE(help.find('\n', at) - at, 120u) << help.substr(at, 60);
    }
}

TEST(JobSchema, ReferenceHasARowForEveryKey) {
    std::ifstream stream(std::string(BATCHENC_SOURCE_DIR) + "/docs/JOB_FILE.md");
    const std::string doc{std::istreambuf_iterator<char>(stream), {}};
    ASSERT_FALSE(doc.empty());
    for (const JobKey& key : job_keys()) {
        const std::string by_default = describe_default(key);
        const bool plain = by_default.empty() || by_default == "required" || key.path == "name";
        const std::string row = "| `" + std::string(key.path) + "` | " + describe_range(key) + " | " +
                                (plain ? by_default : "`" + by_default + "`") + " | " +
                                (key.sweepable ? "yes" : "") + " | " + std::string(key.sentence) + " |";
        EXPECT_NE(doc.find(row), std::string::npos) << "docs/JOB_FILE.md lacks this row:\n" << row;
    }
}

TEST(JobFile, SampleJobsAreValid) {
    int count = 0;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::string(BATCHENC_SOURCE_DIR) + "/jobs")) {
        if (entry.path().extension() != ".yaml") continue;
        const auto jobs = read_job_file(entry.path());
        EXPECT_TRUE(jobs.has_value()) << jobs.error().to_string();
        ++count;
    }
    EXPECT_GE(count, 3);
}

TEST(JobFile, ReadsFromDisk) {
    const auto folder =
        std::filesystem::temp_directory_path() / ("batchenc_job_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder / "sub.yaml");
    std::ofstream(folder / "a.yaml") << kShortest;
    std::ofstream(folder / "huge.yaml") << std::string((1 << 20) + 1, '\n');

    const auto jobs = read_job_file(folder / "a.yaml");
    ASSERT_TRUE(jobs.has_value()) << jobs.error().to_string();
    EXPECT_EQ((*jobs)[0].name, "a");
    EXPECT_EQ((*jobs)[0].input, folder / "a.h5");
    EXPECT_EQ(read_job_file(folder / "none.yaml").error().code, ErrorCode::kIo);
    EXPECT_EQ(read_job_file(folder / "sub.yaml").error().code, ErrorCode::kIo);
    EXPECT_EQ(read_job_file(folder / "huge.yaml").error().code, ErrorCode::kLimit);
    std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace batchenc
