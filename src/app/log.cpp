#include "app/log.h"

#include <fmt/chrono.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <chrono>

namespace batchenc {

namespace {

bool json_lines = false;

void log(spdlog::level::level_enum level, const std::string& message, const nlohmann::json& fields) {
    if (!spdlog::should_log(level)) return;
    if (!json_lines) return spdlog::log(level, "{}", message);
    nlohmann::json line = fields;
    const auto now =
        std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
    line["time"] = fmt::format("{:%Y-%m-%dT%H:%M}:{:%S}Z", fmt::gmtime(now), now.time_since_epoch());
    const auto name = spdlog::level::to_string_view(level);
    line["level"] = std::string(name.data(), name.size());
    line["message"] = message;
    spdlog::log(level, "{}", to_line(line));
}

}  // namespace

void start_log(const std::string& level, bool json) {
    json_lines = json;
    spdlog::set_default_logger(json ? spdlog::stderr_logger_mt("batchenc")
                                    : spdlog::stderr_color_mt("batchenc"));
    spdlog::set_level(spdlog::level::from_str(level));
    spdlog::set_pattern(json ? "%v" : "%H:%M:%S %^%l%$ %v");
}

void log_over_progress_bar() {
    if (!json_lines) spdlog::set_pattern("\r\033[K%H:%M:%S %^%l%$ %v");
}

void log_debug(const std::string& message, const nlohmann::json& fields) {
    log(spdlog::level::debug, message, fields);
}
void log_info(const std::string& message, const nlohmann::json& fields) {
    log(spdlog::level::info, message, fields);
}
void log_warning(const std::string& message, const nlohmann::json& fields) {
    log(spdlog::level::warn, message, fields);
}
void log_error(const std::string& message, const nlohmann::json& fields) {
    log(spdlog::level::err, message, fields);
}
void log_error(const Error& error) { log_error(error.to_string(), {{"error", to_json(error)}}); }

nlohmann::json to_json(const Error& error) {
    return {{"code", static_cast<int>(error.code)},
            {"name", error_code_name(error.code)},
            {"message", error.message},
            {"where", error.where}};
}

std::string to_line(const nlohmann::json& json) {
    return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace batchenc
