#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "core/error.h"

namespace batchenc {

/// Sends the log to stderr: as lines for people, or with `json` as one JSON object a line with the keys time
/// (UTC, ISO 8601), level, message, and the event's own.
/// level: "debug", "info", "warning", "error" or "off".
void start_log(const std::string& level, bool json);

/// Makes each line for people begin by wiping a progress bar that may stand there.
void log_over_progress_bar();

/// fields: an object, shown in the JSON form alone; the message says what a person needs.
void log_debug(const std::string& message, const nlohmann::json& fields = nlohmann::json::object());
void log_info(const std::string& message, const nlohmann::json& fields = nlohmann::json::object());
void log_warning(const std::string& message, const nlohmann::json& fields = nlohmann::json::object());
void log_error(const std::string& message, const nlohmann::json& fields = nlohmann::json::object());
void log_error(const Error& error);

/// {code, name, message, where}
nlohmann::json to_json(const Error& error);

/// A JSON object on one line; bytes that are not UTF-8 (names come from files) are replaced.
std::string to_line(const nlohmann::json& json);

}  // namespace batchenc
