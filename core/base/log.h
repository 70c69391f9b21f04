#pragma once

#include <spdlog/spdlog.h>

#include <cstdint>
#include <string>

namespace relume {

enum class LogFormat { kText, kJson };

// "text" or "json"; anything else throws kInvalidArgument.
LogFormat ParseLogFormat(const std::string& text);

// Sets up spdlog's default logger: to stderr, one line an event; as text for people, or JSON
// objects for machines: ts (UTC), level, logger, pid, msg, and job, worker and lease where a
// LogScope says them. `process` names the program in every line. `level` is trace, debug, info,
// warn, error or off; anything else throws kInvalidArgument. Call once at the start of main().
void InitLogging(const std::string& process, const std::string& level, LogFormat format);

// The reason why a program ends: "process: words", or a JSON line, to stderr, whatever the level.
void LogFatal(const std::string& process, const std::string& words, LogFormat format);

// What a line is about. Empty, 0: not known.
struct LogIds {
    std::string job;
    std::string worker;
    std::uint64_t lease = 0;
};

// The ids of all lines that this thread logs while the object lives; what is not known here is
// taken from the scope around it. Of JSON lines alone.
class LogScope {
  public:
    explicit LogScope(LogIds ids);
    ~LogScope();
    LogScope(const LogScope&) = delete;
    LogScope& operator=(const LogScope&) = delete;

  private:
    LogIds outer_;
};

// The worker that lines without another one are about: that of a process that is one. Thread-safe.
void SetLogWorker(const std::string& worker);

}  // namespace relume
