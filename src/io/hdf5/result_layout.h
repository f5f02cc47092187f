#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

/// Names inside a result that its writer and its reader share (docs/RESULTS.md).
namespace batchenc::result_layout {

inline constexpr char kFormatName[] = "batchenc";
inline constexpr std::int64_t kFormatVersion = 1;
inline constexpr char kDigest[] = "digest";
inline constexpr char kConnectivity[] = "/connectivity";
inline constexpr char kClips[] = "/clips";
inline constexpr char kMetrics[] = "/metrics";
inline constexpr char kAnalysis[] = "/analysis";

/// "000000", "000001", …: at least six digits, so that names sort as numbers.
inline std::string clip_name(std::int64_t index) {
    char text[24];
    std::snprintf(text, sizeof(text), "%06lld", static_cast<long long>(index));
    return text;
}

}  // namespace batchenc::result_layout
