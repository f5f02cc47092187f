// Every way to get a job file wrong: one error, with its place, its code and words that help.
#include <gtest/gtest.h>

#include <chrono>
#include <ostream>

#include "io/job_file.h"

namespace batchenc {
namespace {

struct WrongJob {
    const char* label;
    std::string text;
    ErrorCode code;
    const char* where;     ///< "line:column"
    const char* contains;  ///< part of the message
};

void PrintTo(const WrongJob& wrong, std::ostream* out) { *out << wrong.label; }

constexpr auto kArgument = ErrorCode::kInvalidArgument;
constexpr auto kFormat = ErrorCode::kFormat;
constexpr auto kUnsupported = ErrorCode::kUnsupported;
constexpr auto kLimit = ErrorCode::kLimit;

/// A job whose fourth line is wrong.
std::string with(const std::string& line) {
    return "batchenc: 1\ninput: {file: a.h5}\noutput: b.h5\n" + line + "\n";
}

/// A job whose input lacks or has what the test wants.
std::string with_input(const std::string& input) {
    return "batchenc: 1\ninput: " + input + "\noutput: b.h5\n";
}

class WrongJobs : public testing::TestWithParam<WrongJob> {};

TEST_P(WrongJobs, GiveOneErrorWithItsPlace) {
    const WrongJob& wrong = GetParam();
    const auto jobs = parse_job(wrong.text, "j.yaml");
    ASSERT_FALSE(jobs.has_value()) << "accepted:\n" << wrong.text;
    const Error& error = jobs.error();
    EXPECT_EQ(error.code, wrong.code) << error.to_string();
    EXPECT_EQ(error.where, std::string("j.yaml:") + wrong.where) << error.to_string();
    EXPECT_NE(error.message.find(wrong.contains), std::string::npos) << error.to_string();
    EXPECT_EQ(error.to_string().find('\n'), std::string::npos) << error.to_string();
    EXPECT_LT(error.to_string().size(), 600u);
}

std::string name_of(const testing::TestParamInfo<WrongJob>& info) { return info.param.label; }

INSTANTIATE_TEST_SUITE_P(
    Yaml, WrongJobs,
    testing::Values(
        WrongJob{"Empty", "", kFormat, "1:1", "holds no job"},
        WrongJob{"CommentOnly", "# nothing\n", kFormat, "1:1", "holds no job"},
        WrongJob{"NulByte", with(std::string("name: a\0b", 9)), kFormat, "4:8", "NUL"},
        WrongJob{"NotUtf8", with("name: a\xFF"), kFormat, "4:8", "not UTF-8"},
        WrongJob{"OverlongUtf8", with("name: \xC0\xAF"), kFormat, "4:7", "not UTF-8"},
        WrongJob{"Surrogate", with("name: \xED\xA0\x80"), kFormat, "4:7", "not UTF-8"},
        WrongJob{"CutUtf8", "name: \xE2\x82", kFormat, "1:7", "not UTF-8"},
        WrongJob{"Utf16",
                 std::string("\xFF\xFE"
                             "b\0",
                             4),
                 kFormat, "1:1", "not UTF-8"},
        WrongJob{"Tab", with("clips:\n\tlength: 3"), kFormat, "5:1", "tab"},
        WrongJob{"Bell", with("name: a\a"), kFormat, "4:8", "control"},
        WrongJob{"LoneCarriageReturn", with("name: a\rname: b"), kFormat, "4:8", "control"},
        WrongJob{"LineSeparator", with("name: a\xE2\x80\xA8"), kFormat, "4:8", "control"},
        WrongJob{"Directive", "%YAML 1.1\n---\n" + with(""), kFormat, "1:1", "directive"},
        WrongJob{"SecondDocument", with("---\nbatchenc: 1"), kFormat, "4:1", "second document"},
        WrongJob{"TextAfterEnd", with("...\nbatchenc: 1"), kFormat, "5:1", "second document"},
        WrongJob{"Anchor", with("name: &n dance"), kFormat, "4:7", "anchor"},
        WrongJob{"AnchorOnMapping", with("clips: &c {length: 3}"), kFormat, "4:8", "anchor"},
        WrongJob{"AnchorOnNothing", with("name: &n"), kFormat, "4:7", "anchor"},
        WrongJob{"Alias", with("name: *n"), kFormat, "4:7", "not valid YAML"},
        WrongJob{"AliasBomb", "a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n", kFormat, "1:4", "anchor"},
        WrongJob{"Tag", with("name: !!str dance"), kFormat, "4:7", "tag"},
        WrongJob{"TagOnMapping", with("clips: !!map {length: 3}"), kFormat, "4:8", "tag"},
        WrongJob{"DuplicateKey", with("name: a\nname: b"), kFormat, "5:1",
                 "'name' stands here a second time"},
        WrongJob{"DuplicateQuotedKey", with("'output': c.h5"), kFormat, "4:1", "second time"},
        WrongJob{"DuplicateNestedKey", with("clips: {length: 3, length: 4}"), kFormat, "4:20", "second time"},
        WrongJob{"ListAsKey", with("? [a]\n: 2"), kFormat, "4:3", "single word"},
        WrongJob{"NoKey", with(": 2"), kFormat, "4:1", "key is missing"},
        WrongJob{"Unclosed", with("clips: {length: 3"), kFormat, "5:1", "not valid YAML"},
        WrongJob{"MissingColon", with("name: dance\n  analysis true"), kFormat, "4:7", "missing ':'"},
        WrongJob{"TooDeepLists", "- - - - - - - - - 1", kLimit, "1:17", "deeper"},
        WrongJob{"TooDeep", "a: [[[[[[[[1]]]]]]]]", kLimit, "1:11", "deeper"},
        WrongJob{"ColumnCountsCharacters", with("\"ä\\x41\": é"), kArgument, "4:1", "unknown key 'äA'"},
        WrongJob{"ColumnAfterAccents", with("segmentation: {\"é\": 1}"), kArgument, "4:16",
                 "unknown key 'é'"}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Keys, WrongJobs,
    testing::Values(
        WrongJob{"NoMapping", "just words\n", kArgument, "1:1", "mapping of keys"},
        WrongJob{"List", "- batchenc: 1\n", kArgument, "1:1", "mapping of keys"},
        WrongJob{"NoVersion", "name: a\n", kArgument, "1:1", "'batchenc: 1'"},
        WrongJob{"LaterVersion", "novelty: 3\nbatchenc: 2\n", kUnsupported, "2:11", "version 2"},
        WrongJob{"VersionNoInteger", "batchenc: 1.0\n", kArgument, "1:11", "plain decimal"},
        WrongJob{"NoInput", "batchenc: 1\noutput: b.h5\n", kArgument, "1:1", "'input' is missing"},
        WrongJob{"NoInputFile", with_input("{frames: [0, 1]}"), kArgument, "2:8", "'input.file' is missing"},
        WrongJob{"NoOutput", "batchenc: 1\ninput: {file: a.h5}\n", kArgument, "1:1", "'output' is missing"},
        WrongJob{"InputIsText", with_input("a.h5"), kArgument, "2:8", "{file: clip.h5}"},
        WrongJob{"UnknownKey", with("zebra: 1"), kArgument, "4:1", "unknown key 'zebra'"},
        WrongJob{"NearKey", with("segmentaton: {}"), kArgument, "4:1", "did you mean 'segmentation'?"},
        WrongJob{"SwappedLetters", with("nmae: x"), kArgument, "4:1", "did you mean 'name'?"},
        WrongJob{"UpperCase", with("Codec: {}"), kArgument, "4:1", "did you mean 'codec'?"},
        WrongJob{"NearNestedKey", with("codec: {componets: 3}"), kArgument, "4:9",
                 "did you mean 'components'?"},
        WrongJob{"DashForUnderscore", with("codec: {basis-bits: 3}"), kArgument, "4:9", "'basis_bits'?"},
        WrongJob{"KeyAtTheWrongLevel", with("clusters: 3"), kArgument, "4:1", "belongs under 'segmentation'"},
        WrongJob{"DottedKey", with("codec.components: 3"), kArgument, "4:1", "belongs under 'codec'"},
        WrongJob{"TopKeyBelow", with("codec: {analysis: true}"), kArgument, "4:9", "top of the file"},
        WrongJob{"MergeKey", with("<<: {name: a}"), kArgument, "4:1", "unknown key '<<'"},
        WrongJob{"LongKey", with("'" + std::string(900, 'k') + "': 1"), kArgument, "4:1", "kkk...'"},
        WrongJob{"KeyWithLineBreak", with("\"a\\nb\": 1"), kArgument, "4:1", "'a?b'"},
        WrongJob{"TargetOfAnotherCoder", with("codec: {target: {kg: 0.1}}"), kUnsupported, "4:8",
                 "codec.target.kg: codec.method 'rlpca' takes no targets"},
        WrongJob{"TargetOfOtherCoders", with("codec: {method: static, target: {da: 0.1}}"), kUnsupported,
                 "4:8", "takes other targets: max_error or max_error_relative"},
        WrongJob{"TwoTargets", with("codec: {method: orlpca, target: {da: 0.1, bpvf: 2}}"), kArgument, "4:8",
                 "da and bpvf exclude each other"},
        WrongJob{"NoTarget", with("codec: {method: orlpca}"), kArgument, "4:8",
                 "needs a codec.target: kg, da, bpvf or components"},
        WrongJob{"NearTarget", with("codec: {target: {bpv: 2}}"), kArgument, "4:18", "did you mean 'bpvf'?"}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Values, WrongJobs,
    testing::Values(
        WrongJob{"Octal", with("codec: {components: 010}"), kArgument, "4:21", "leading zero"},
        WrongJob{"Octal12", with("codec: {components: 0o10}"), kArgument, "4:21", "plain decimal"},
        WrongJob{"Hexadecimal", with("codec: {components: 0x10}"), kArgument, "4:21", "plain decimal"},
        WrongJob{"Underscore", with("codec: {components: 1_000}"), kArgument, "4:21", "plain decimal"},
        WrongJob{"Sexagesimal", with("codec: {components: 1:30}"), kArgument, "4:21", "plain decimal"},
        WrongJob{"Exponent", with("codec: {components: 1e1}"), kArgument, "4:21", "plain decimal"},
        WrongJob{"Fraction", with("codec: {components: 20.0}"), kArgument, "4:21", "plain decimal"},
        WrongJob{"Infinity", with("codec: {components: .inf}"), kArgument, "4:21", "plain decimal"},
        WrongJob{"Plus", with("codec: {components: +5}"), kArgument, "4:21", "plain decimal"},
        WrongJob{"Minus", with("codec: {components: -}"), kArgument, "4:21", "plain decimal"},
        WrongJob{"MinusZero", with("clips: {length: -0}"), kArgument, "4:17", "plain decimal"},
        WrongJob{"Negative", with("clips: {length: -1}"), kArgument, "4:17", "outside 0 to 16777216"},
        WrongJob{"QuotedNumber", with("codec: {components: '20'}"), kArgument, "4:21", "without them"},
        WrongJob{"NumberIsNull", with("codec: {components: }"), kArgument, "4:21", "holds nothing"},
        WrongJob{"NumberIsTilde", with("codec: {components: ~}"), kArgument, "4:21", "holds nothing"},
        WrongJob{"NumberIsList", with("codec: {components: [1]}"), kArgument, "4:21", "holds a list"},
        WrongJob{"NumberIsMapping", with("codec: {components: {a: 1}}"), kArgument, "4:21",
                 "holds a mapping"},
        WrongJob{"Zero", with("codec: {components: 0}"), kArgument, "4:21", "outside 1 to 4096"},
        WrongJob{"TooLarge", with("codec: {components: 4097}"), kArgument, "4:21", "outside 1 to 4096"},
        WrongJob{"FarTooLarge", with("codec: {components: 4294967297}"), kArgument, "4:21",
                 "outside 1 to 4096"},
        WrongJob{"Overflow", with("codec: {components: 99999999999999999999}"), kArgument, "4:21", "outside"},
        WrongJob{"Yes", with("analysis: yes"), kArgument, "4:11", "true or false"},
        WrongJob{"CapitalTrue", with("analysis: True"), kArgument, "4:11", "true or false"},
        WrongJob{"QuotedTrue", with("analysis: 'true'"), kArgument, "4:11", "true or false"},
        WrongJob{"NearMethod", with("codec: {method: rlpac}"), kArgument, "4:17", "did you mean 'rlpca'?"},
        WrongJob{"NoMethod", with("codec: {method: mp3}"), kArgument, "4:17", "accepted: rlpca"},
        WrongJob{"NoSpace", with("codec: {space: outer}"), kArgument, "4:16", "accepted: local, world"},
        WrongJob{"MethodIsList", with("codec: {method: [rlpca]}"), kArgument, "4:17", "accepted: rlpca"},
        WrongJob{"SegmentationUnknown", with("segmentation: {method: growing}"), kArgument, "4:24",
                 "accepted: region-growing, clustering, adaptive, rigid"},
        WrongJob{"ThresholdTooLarge", with("segmentation: {threshold: 1.5}"), kArgument, "4:27", "0 to 1"},
        WrongJob{"NegativeThreshold", with("segmentation: {threshold: -0.1}"), kArgument, "4:27", "0 to 1"},
        WrongJob{"ThresholdHuge", with("segmentation: {threshold: 1e999}"), kArgument, "4:27", "0 to 1"},
        WrongJob{"ThresholdOctal", with("segmentation: {threshold: 00.5}"), kArgument, "4:27", "a number"},
        WrongJob{"ThresholdBarePoint", with("segmentation: {threshold: .5}"), kArgument, "4:27", "a number"},
        WrongJob{"ThresholdPointAlone", with("segmentation: {threshold: 0.}"), kArgument, "4:27", "a number"},
        WrongJob{"ThresholdNoExponent", with("segmentation: {threshold: 1e}"), kArgument, "4:27", "a number"},
        WrongJob{"ThresholdInfinity", with("segmentation: {threshold: .inf}"), kArgument, "4:27", "a number"},
        WrongJob{"ThresholdQuoted", with("segmentation: {threshold: '0.5'}"), kArgument, "4:27", "quotes"},
        WrongJob{"ThresholdIsList", with("segmentation: {threshold: [0.5]}"), kArgument, "4:27", "a list"},
        WrongJob{"NoOrder", with("order: sorted"), kArgument, "4:8", "accepted: preserve, free"},
        WrongJob{"NearOrder", with("order: fre"), kArgument, "4:8", "did you mean 'free'?"},
        WrongJob{"NoLength", with("clips: {length: automatic}"), kArgument, "4:17", "or the word auto"},
        WrongJob{"LengthInCapitals", with("clips: {length: Auto}"), kArgument, "4:17", "or the word auto"},
        WrongJob{"LengthBelowZero", with("clips: {length: -1}"), kArgument, "4:17", "outside 0 to"},
        WrongJob{"LengthQuoted", with("clips: {length: 'auto'}"), kArgument, "4:17", "quotes"},
        WrongJob{"NameIsNumber", with("name: 010"), kArgument, "4:7", "in quotes"},
        WrongJob{"NameIsBoolean", with("name: No"), kArgument, "4:7", "in quotes"},
        WrongJob{"NameIsDate", with("name: 2024-01-02"), kArgument, "4:7", "in quotes"},
        WrongJob{"NameIsNull", with("name: null"), kArgument, "4:7", "holds nothing"},
        WrongJob{"NameIsEmpty", with("name: ''"), kArgument, "4:7", "empty"},
        WrongJob{"NameHasSlash", with("name: a/b"), kArgument, "4:7", "slash"},
        WrongJob{"NameHasLineBreak", with("name: \"a\\nb\""), kArgument, "4:7", "control"},
        WrongJob{"NameHasNul", with("name: \"a\\0b\""), kArgument, "4:7", "control"},
        WrongJob{"NameTooLong", with("name: " + std::string(256, 'n')), kArgument, "4:7", "255"},
        WrongJob{"InputIsFolder", with_input("{file: data/}"), kArgument, "2:15", "a folder"},
        WrongJob{"InputIsHome", with_input("{file: ~/a.h5}"), kArgument, "2:15", "not expanded"},
        WrongJob{"OutputIsInput", "batchenc: 1\ninput: {file: a.h5}\noutput: ./x/../a.h5\n", kArgument, "3:9",
                 "output is the input"},
        WrongJob{"RelativeDataset", with_input("{file: a.h5, positions: p}"), kArgument, "2:32",
                 "from the root"},
        WrongJob{"FramesIsNumber", with_input("{file: a.h5, frames: 5}"), kArgument, "2:29", "[begin, end]"},
        WrongJob{"FramesHasThree", with_input("{file: a.h5, frames: [0, 1, 2]}"), kArgument, "2:29",
                 "[begin"},
        WrongJob{"FramesIsEmpty", with_input("{file: a.h5, frames: [5, 5]}"), kArgument, "2:29", "no frame"},
        WrongJob{"FramesNegative", with_input("{file: a.h5, frames: [-1, 5]}"), kArgument, "2:30", "outside"},
        WrongJob{"FramesOctal", with_input("{file: a.h5, frames: [0, 010]}"), kArgument, "2:33",
                 "leading zero"}),
    name_of);

/// Seconds to read the text, which must not be accepted for its size.
double time_to_read(const std::string& text) {
    const auto start = std::chrono::steady_clock::now();
    EXPECT_FALSE(parse_job(text, "j.yaml").has_value());
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

TEST(HostileJobs, AreRefusedQuickly) {
    // Long enough that quadratic work would take minutes, short enough for a sanitizer.
    for (const std::string piece :
         {"[",  "{",   "- ",  "? ",  "a: ",     "[1,",   "{a: ", "\"",  "'",  "|\n", "-\n",
          "[]", "&a ", "!a ", "a\n", "{a: 1},", "---\n", "#",    " \n", "1,", "é"}) {
        std::string text;
        while (text.size() < 1 << 17) text += piece;
        EXPECT_LT(time_to_read(text), 10.0) << piece;
        EXPECT_LT(time_to_read("batchenc: 1\nsweep: {codec.components: [" + text), 10.0) << piece;
    }
}

TEST(HostileJobs, EveryTruncationIsAnErrorOrAJob) {
    const std::string text =
        with("codec: {components: 12}\nsweep: {segmentation.clusters: [1, 2]}").replace(40, 4, "{clusters}");
    for (std::size_t size = 0; size < text.size(); ++size) {
        const auto jobs = parse_job(std::string(text, 0, size), "j.yaml");
        if (!jobs) {
            EXPECT_TRUE(jobs.error().where.starts_with("j.yaml:")) << jobs.error().to_string();
        }
    }
}

}  // namespace
}  // namespace batchenc
