#include "io/job/job_yaml.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <cstdint>
#include <istream>
#include <new>
#include <optional>
#include <streambuf>
#include <unordered_set>

namespace batchenc {
namespace {

/// Carries an Error out of yaml-cpp's callbacks; never leaves this file.
struct Refusal {
    ErrorCode code;
    std::string message;
    TextPosition at;
};

/// A stream over text that stays where it is.
class TextBuffer final : public std::streambuf {
 public:
    explicit TextBuffer(std::string_view text) {
        char* begin = const_cast<char*>(text.data());  // the get area is never written to
        setg(begin, begin, begin + text.size());
    }
};

/// Bytes of the well-formed UTF-8 character at the start of `text` with its code point, or nothing.
std::optional<std::pair<std::size_t, std::uint32_t>> first_character(std::string_view text) {
    const auto byte = [&](std::size_t i) {
        return static_cast<std::uint32_t>(static_cast<std::uint8_t>(text[i]));
    };
    const std::uint32_t lead = byte(0);
    if (lead < 0x80) return std::pair{std::size_t{1}, lead};
    const std::size_t size = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
    constexpr std::uint32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};
    if (lead < 0xC2 || lead > 0xF4 || text.size() < size) return std::nullopt;
    std::uint32_t code = lead & (0xFFu >> (size + 1));
    for (std::size_t i = 1; i < size; ++i) {
        if ((byte(i) & 0xC0) != 0x80) return std::nullopt;
        code = code << 6 | (byte(i) & 0x3F);
    }
    if (code < kSmallest[size] || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return std::nullopt;
    return std::pair{size, code};
}

/// The text's lines, to turn byte columns into characters and to look at what stands at a place.
class Lines {
 public:
    explicit Lines(std::string_view text) : text_(text) {
        starts_.push_back(0);
        for (std::size_t i = 0; i < text.size(); ++i) {
            if (text[i] == '\n') starts_.push_back(i + 1);
        }
    }

    std::size_t offset(int line, int byte_column) const {
        if (line < 0 || byte_column < 0) return 0;
        const std::size_t start = starts_[std::min(static_cast<std::size_t>(line), starts_.size() - 1)];
        return std::min(start + static_cast<std::size_t>(byte_column), text_.size());
    }
    TextPosition position(const YAML::Mark& mark) const {
        return position_of(mark.line, offset(mark.line, mark.column));
    }
    TextPosition position(std::size_t offset) const {
        const auto after = std::upper_bound(starts_.begin(), starts_.end(), offset);
        return position_of(static_cast<int>(after - starts_.begin()) - 1, offset);
    }
    bool stands_at(const YAML::Mark& mark, std::string_view word) const {
        return text_.substr(offset(mark.line, mark.column), word.size()) == word;
    }

 private:
    TextPosition position_of(int line, std::size_t offset) const {
        const std::size_t index = std::min(static_cast<std::size_t>(std::max(line, 0)), starts_.size() - 1);
        // Values are met from left to right: counting on from the last one keeps a long line from costing
        // its length for each of them.
        if (index != counted_line_ || offset < counted_to_) {
            counted_line_ = index;
            counted_to_ = starts_[index];
            column_ = 1;
        }
        for (; counted_to_ < offset; ++counted_to_) {
            column_ += (static_cast<std::uint8_t>(text_[counted_to_]) & 0xC0) != 0x80;
        }
        return {static_cast<int>(index) + 1, column_};
    }

    std::string_view text_;
    std::vector<std::size_t> starts_;
    mutable std::size_t counted_line_ = 0;
    mutable std::size_t counted_to_ = 0;
    mutable int column_ = 1;
};

/// Builds the tree from yaml-cpp's events. The library's own nodes are not used: they keep duplicate keys,
/// expand aliases and drop what follows the first document.
class TreeBuilder final : public YAML::EventHandler {
 public:
    explicit TreeBuilder(const Lines& lines) : lines_(lines) {}

    bool has_document() const { return documents_ > 0; }
    YamlNode take() { return std::move(root_); }

    void OnDocumentStart(const YAML::Mark& mark) override {
        if (++documents_ > 1) refuse(mark, "a second document begins here; a job file holds one job");
    }
    void OnDocumentEnd() override {}

    void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        refuse_anchor(mark, anchor);
        add(YamlNode{YamlNode::Kind::kNull, lines_.position(mark), {}, {}, {}});
    }
    void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
        refuse(mark, "aliases (*name) are not accepted; write the value out");
    }
    void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  const std::string& value) override {
        refuse_anchor(mark, anchor);
        const bool plain = tag == "?";
        if (!plain && tag != "!") refuse(mark, "tags (!!name) are not accepted");
        // Plain text is taken as it stands in its line. What yaml-cpp folded together from several lines is
        // usually a key whose colon is missing.
        if (plain && !lines_.stands_at(mark, value)) {
            refuse(mark,
                   "a value without quotes runs over several lines; put it in quotes, or look for a missing "
                   "':'");
        }
        add(YamlNode{
            plain ? YamlNode::Kind::kPlain : YamlNode::Kind::kQuoted, lines_.position(mark), value, {}, {}});
    }
    void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                         YAML::EmitterStyle::value) override {
        open(YamlNode::Kind::kSequence, mark, tag, anchor);
    }
    void OnSequenceEnd() override { close(); }
    void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                    YAML::EmitterStyle::value) override {
        open(YamlNode::Kind::kMapping, mark, tag, anchor);
    }
    void OnMapEnd() override { close(); }

 private:
    /// A collection whose end has not been seen yet.
    struct Open {
        YamlNode node;
        std::optional<YamlNode> key;  ///< of a mapping: the key that waits for its value
        std::unordered_set<std::string> keys;
    };

    [[noreturn]] void refuse(const YAML::Mark& mark, std::string message) const {
        throw Refusal{ErrorCode::kFormat, std::move(message), lines_.position(mark)};
    }
    void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) const {
        if (anchor != YAML::NullAnchor) refuse(mark, "anchors (&name) are not accepted");
    }
    void open(YamlNode::Kind kind, const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor) {
        refuse_anchor(mark, anchor);
        if (!tag.empty() && tag != "?" && tag != "!") refuse(mark, "tags (!!name) are not accepted");
        if (stack_.size() >= kMaxYamlDepth) {
            throw Refusal{ErrorCode::kLimit,
                          "nested deeper than " + std::to_string(kMaxYamlDepth) + " levels",
                          lines_.position(mark)};
        }
        if (!stack_.empty() && stack_.back().node.kind == YamlNode::Kind::kMapping && !stack_.back().key) {
            refuse(mark, "a key must be a single word");
        }
        Open opened;
        opened.node.kind = kind;
        opened.node.at = lines_.position(mark);
        stack_.push_back(std::move(opened));
    }
    void close() {
        YamlNode node = std::move(stack_.back().node);
        stack_.pop_back();
        add(std::move(node));
    }
    void add(YamlNode node) {
        if (stack_.empty()) {
            root_ = std::move(node);
            return;
        }
        Open& parent = stack_.back();
        if (parent.node.kind == YamlNode::Kind::kSequence) {
            parent.node.items.push_back(std::move(node));
        } else if (!parent.key) {
            if (node.kind == YamlNode::Kind::kNull) {
                throw Refusal{ErrorCode::kFormat, "a key is missing before ':'", node.at};
            }
            if (!parent.keys.insert(node.text).second) {
                throw Refusal{ErrorCode::kFormat,
                              "key " + quoted_for_message(node.text) + " stands here a second time", node.at};
            }
            parent.key = std::move(node);
        } else {
            parent.node.entries.push_back(
                YamlEntry{std::move(parent.key->text), parent.key->at, std::move(node)});
            parent.key.reset();
        }
    }

    const Lines& lines_;
    std::vector<Open> stack_;
    YamlNode root_;
    int documents_ = 0;
};

/// What no job file contains, looked for before yaml-cpp sees the text.
std::optional<std::pair<std::size_t, const char*>> find_refused_byte(std::string_view text) {
    const std::size_t bad = find_unprintable(text, true);
    if (bad < text.size()) {
        if (text[bad] == '\t') return std::pair{bad, "a tab; job files use spaces"};
        if (text[bad] == '\0') return std::pair{bad, "a NUL byte; this is not a text file in UTF-8"};
        if (first_character(text.substr(bad))) return std::pair{bad, "a control character"};
        return std::pair{bad, "a byte that is not UTF-8"};
    }
    for (std::size_t at = 0; at < text.size();) {
        if (text[at] == '%') return std::pair{at, "directives (%NAME) are not accepted"};
        const std::size_t end = text.find('\n', at);
        if (end == std::string_view::npos) break;
        at = end + 1;
    }
    return std::nullopt;
}

}  // namespace

std::string place_in(const std::string& file, TextPosition at) {
    return file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column);
}

std::size_t find_unprintable(std::string_view text, bool line_breaks) {
    for (std::size_t at = 0; at < text.size();) {
        const auto character = first_character(text.substr(at));
        if (!character) return at;
        const auto [size, code] = *character;
        const bool line_break = code == '\n' || (code == '\r' && text.substr(at, 2) == "\r\n");
        // U+0080 to U+009F are control characters too, and U+2028, U+2029 break lines for some readers.
        const bool control = code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x2028 || code == 0x2029;
        if (control && !(line_breaks && line_break)) return at;
        at += size;
    }
    return text.size();
}

std::string quoted_for_message(std::string_view text) {
    constexpr std::size_t kLongest = 60;
    std::string shown;
    while (!text.empty()) {
        const auto character = first_character(text);
        const std::size_t size = character ? character->first : 1;
        if (shown.size() + size > kLongest) return "'" + shown + "...'";
        const bool printable = find_unprintable(text.substr(0, size), false) == size;
        shown += printable ? text.substr(0, size) : std::string_view("?");
        text.remove_prefix(size);
    }
    return "'" + shown + "'";
}

Expected<YamlNode> parse_strict_yaml(std::string_view text, const std::string& file) {
    try {
        if (text.size() > kMaxJobFileBytes) {
            return fail(ErrorCode::kLimit,
                        "a job file may have " + std::to_string(kMaxJobFileBytes) + " bytes at most",
                        place_in(file, {}));
        }
        constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
        if (text.substr(0, kByteOrderMark.size()) == kByteOrderMark)
            text.remove_prefix(kByteOrderMark.size());

        const Lines lines(text);
        if (const auto refused = find_refused_byte(text)) {
            return fail(ErrorCode::kFormat, refused->second, place_in(file, lines.position(refused->first)));
        }
        TextBuffer buffer(text);
        std::istream stream(&buffer);
        TreeBuilder builder(lines);
        try {
            YAML::Parser parser(stream);
            while (parser.HandleNextDocument(builder)) {
            }
        } catch (const Refusal& refusal) {
            return fail(refusal.code, refusal.message, place_in(file, refusal.at));
        } catch (const YAML::Exception& error) {
            const TextPosition at = error.mark.is_null() ? TextPosition{} : lines.position(error.mark);
            return fail(ErrorCode::kFormat, "not valid YAML: " + error.msg, place_in(file, at));
        }
        if (!builder.has_document()) {
            return fail(ErrorCode::kFormat, "the file holds no job", place_in(file, {}));
        }
        return builder.take();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to read the job file", file);
    }
}

}  // namespace batchenc
