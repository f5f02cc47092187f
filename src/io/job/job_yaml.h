#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"

namespace batchenc {

/// A place in a text file, counted from 1; columns count characters, not bytes.
struct TextPosition {
    int line = 1;
    int column = 1;
};

/// "file:line:column", as it stands in Error::where.
std::string place_in(const std::string& file, TextPosition at);

struct YamlEntry;

/// One value of a job file with the place where it starts. Plain and quoted scalars stay apart, because 20 is
/// a number and "20" is a text.
struct YamlNode {
    enum class Kind { kNull, kPlain, kQuoted, kSequence, kMapping };

    Kind kind = Kind::kNull;
    TextPosition at;
    std::string text;                ///< of kPlain and kQuoted, escapes resolved
    std::vector<YamlNode> items;     ///< of kSequence
    std::vector<YamlEntry> entries;  ///< of kMapping, in the order of the file, no key twice
};

/// A key of a mapping and what stands under it.
struct YamlEntry {
    std::string key;
    TextPosition at;  ///< of the key
    YamlNode value;
};

/// Largest job file and deepest nesting that are read.
inline constexpr std::size_t kMaxJobFileBytes = std::size_t{1} << 20;
inline constexpr int kMaxYamlDepth = 8;

/// Reads the one YAML document of a text, without what readers of YAML disagree about or what could be used
/// to make a small file large: refused are text that is not UTF-8, control characters, tabs, directives,
/// anchors, aliases, tags, keys that are no scalars, duplicate keys, values that run over several lines
/// without quotes, and a second document. A byte order mark and CRLF line ends are accepted.
///
/// text: the whole file. file: stands in errors.
/// Errors: kLimit (longer than kMaxJobFileBytes, nested deeper than kMaxYamlDepth), kFormat (everything
/// else), kOutOfMemory.
Expected<YamlNode> parse_strict_yaml(std::string_view text, const std::string& file);

/// A text from a job file made fit for one line of an error: in single quotes, cut when long.
std::string quoted_for_message(std::string_view text);

/// Index of the first byte that is not part of a printable UTF-8 character; text.size() when there is none.
/// Line breaks count as printable where `line_breaks` is set.
std::size_t find_unprintable(std::string_view text, bool line_breaks);

}  // namespace batchenc
