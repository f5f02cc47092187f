#include "core/error.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace batchenc {
namespace {

TEST(Error, CodesAndNamesArePinned) {
    // Scripts rely on both; a line may be added here, none changed.
    const std::pair<int, const char*> pinned[] = {
        {1, "invalid-argument"}, {2, "io"},         {3, "format"},       {4, "corrupt"},
        {5, "unsupported"},      {6, "limit"},      {7, "not-finite"},   {8, "out-of-range"},
        {9, "exists"},           {10, "numerical"}, {11, "interrupted"}, {12, "out-of-memory"},
        {13, "verification"},    {14, "internal"},
    };
    std::set<std::string> names;
    for (const auto& [number, name] : pinned) {
        EXPECT_STREQ(error_code_name(static_cast<ErrorCode>(number)), name);
        EXPECT_TRUE(names.insert(name).second) << name;
    }
    EXPECT_STREQ(error_code_name(static_cast<ErrorCode>(0)), "unknown");
    EXPECT_STREQ(error_code_name(static_cast<ErrorCode>(15)), "unknown");
}

TEST(Error, SaysWhereWhatAndWhich) {
    EXPECT_EQ((Error{ErrorCode::kCorrupt, "checksum differs", "a.h5:/x"}).to_string(),
              "a.h5:/x: checksum differs [corrupt]");
    EXPECT_EQ((Error{ErrorCode::kLimit, "too many", ""}).to_string(), "too many [limit]");
}

TEST(Error, OuterPlaceStandsFirst) {
    const Expected<int> inner = fail(ErrorCode::kIo, "no space", "section basis");
    const Expected<int> outer = fail_within("clip 2", inner.error());
    ASSERT_FALSE(outer.has_value());
    EXPECT_EQ(outer.error().where, "clip 2: section basis");
    EXPECT_EQ(outer.error().message, "no space");
    EXPECT_EQ(outer.error().code, ErrorCode::kIo);

    const Expected<int> bare = fail_within("clip 2", Error{ErrorCode::kIo, "no space", ""});
    EXPECT_EQ(bare.error().where, "clip 2");
}

}  // namespace
}  // namespace batchenc
