#include "core/base/log.h"

#include <spdlog/details/os.h>
#include <spdlog/formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <chrono>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"

namespace relume {
namespace {

thread_local LogIds scope_ids;

std::mutex worker_mutex;
std::string process_worker;  // guarded by worker_mutex

std::string ProcessWorker() {
    const std::lock_guard lock(worker_mutex);
    return process_worker;
}

// RFC 3339, UTC, milliseconds.
std::string Timestamp(std::chrono::system_clock::time_point time) {
    const auto millis =
        std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
    const std::tm utc = spdlog::details::os::gmtime(std::chrono::system_clock::to_time_t(time));
    return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", utc.tm_year + 1900,
                       utc.tm_mon + 1, utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec,
                       millis % 1000);
}

std::string JsonLine(std::chrono::system_clock::time_point time, spdlog::string_view_t level,
                     spdlog::string_view_t logger, spdlog::string_view_t message) {
    nlohmann::ordered_json line;
    const auto text = [](spdlog::string_view_t view) {
        return std::string(view.data(), view.size());
    };
    line["ts"] = Timestamp(time);
    line["level"] = text(level);
    line["logger"] = text(logger);
    line["pid"] = spdlog::details::os::pid();
    line["msg"] = text(message);
    if (!scope_ids.job.empty()) {
        line["job"] = scope_ids.job;
    }
    if (std::string worker = scope_ids.worker.empty() ? ProcessWorker() : scope_ids.worker;
        !worker.empty()) {
        line["worker"] = std::move(worker);
    }
    if (scope_ids.lease != 0) {
        line["lease"] = scope_ids.lease;
    }
    // Paths and words of others may be no UTF-8.
    return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

class JsonFormatter final : public spdlog::formatter {
  public:
    void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& to) override {
        const std::string line =
            JsonLine(message.time, spdlog::level::to_string_view(message.level),
                     message.logger_name, message.payload);
        to.append(line.data(), line.data() + line.size());
    }
    std::unique_ptr<spdlog::formatter> clone() const override {
        return std::make_unique<JsonFormatter>();
    }
};

}  // namespace

LogFormat ParseLogFormat(const std::string& text) {
    if (text == "text") {
        return LogFormat::kText;
    }
    if (text == "json") {
        return LogFormat::kJson;
    }
    ThrowInvalidArgument("unknown log format '" + text + "'; known: text, json");
}

void InitLogging(const std::string& process, const std::string& level, LogFormat format) {
    const auto parsed = spdlog::level::from_str(level);
    if (parsed == spdlog::level::off && level != "off") {
        ThrowInvalidArgument("unknown log level '" + level +
                             "'; known: trace, debug, info, warn, error, off");
    }
    spdlog::drop(process);  // of an earlier call
    std::shared_ptr<spdlog::logger> logger;
    if (format == LogFormat::kJson) {
        logger = spdlog::stderr_logger_mt(process);
        logger->set_formatter(std::make_unique<JsonFormatter>());
    } else {
        logger = spdlog::stderr_color_mt(process);
        logger->set_pattern("%H:%M:%S.%e %n %^%l%$ %v");
    }
    logger->set_level(parsed);
    logger->flush_on(spdlog::level::info);
    spdlog::set_default_logger(std::move(logger));
}

void LogFatal(const std::string& process, const std::string& words, LogFormat format) {
    const std::string line = format == LogFormat::kJson ? JsonLine(std::chrono::system_clock::now(),
                                                                   "critical", process, words)
                                                        : fmt::format("{}: {}\n", process, words);
    std::fwrite(line.data(), 1, line.size(), stderr);
}

LogScope::LogScope(LogIds ids) : outer_(scope_ids) {
    if (!ids.job.empty()) {
        scope_ids.job = std::move(ids.job);
    }
    if (!ids.worker.empty()) {
        scope_ids.worker = std::move(ids.worker);
    }
    if (ids.lease != 0) {
        scope_ids.lease = ids.lease;
    }
}

LogScope::~LogScope() { scope_ids = std::move(outer_); }

void SetLogWorker(const std::string& worker) {
    const std::lock_guard lock(worker_mutex);
    process_worker = worker;
}

}  // namespace relume
