// Preloaded by tests/chaos (LD_PRELOAD) into a program that then believes in another wall clock:
// the real one plus as many nanoseconds as the file RELUME_CHAOS_CLOCK says (int64, mapped, so that
// it may change at any time). Only CLOCK_REALTIME jumps, as it does on a machine. Waits on a futex
// until an instant of the wall clock, as Abseil's and so gRPC's are, end when the jumped clock says
// so: early, late, or as if it had not jumped.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kSlice = kSecond / 20;  // a wait looks at the clock as often

const std::atomic<std::int64_t>* Offset() {
    static const std::atomic<std::int64_t> none{0};
    static const auto* offset = [] {
        const char* path = std::getenv("RELUME_CHAOS_CLOCK");
        const int fd = path != nullptr ? open(path, O_RDONLY | O_CLOEXEC) : -1;
        void* at = fd < 0 ? MAP_FAILED : mmap(nullptr, sizeof none, PROT_READ, MAP_SHARED, fd, 0);
        if (fd >= 0) {
            close(fd);
        }
        return at == MAP_FAILED ? &none : static_cast<const std::atomic<std::int64_t>*>(at);
    }();
    return offset;
}

template <typename F>
F* Next(F*, const char* name) {
    return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}

std::int64_t Nanoseconds(const timespec& t) { return t.tv_sec * kSecond + t.tv_nsec; }
timespec Timespec(std::int64_t ns) { return {ns / kSecond, ns % kSecond}; }

std::int64_t RealNow() {
    static const auto real = Next(&clock_gettime, "clock_gettime");
    timespec now{};
    real(CLOCK_REALTIME, &now);
    return Nanoseconds(now);
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* time) noexcept {
    static const auto real = Next(&clock_gettime, "clock_gettime");
    const int result = real(clock, time);
    if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
        *time = Timespec(Nanoseconds(*time) + Offset()->load());
    }
    return result;
}

int gettimeofday(timeval* time, void*) noexcept {
    const std::int64_t now = RealNow() + Offset()->load();
    *time = {now / kSecond, now % kSecond / 1000};
    return 0;
}

time_t time(time_t* out) noexcept {
    const time_t now = (RealNow() + Offset()->load()) / kSecond;
    if (out != nullptr) {
        *out = now;
    }
    return now;
}

long syscall(long number, ...) noexcept {
    static const auto real = Next(&syscall, "syscall");
    va_list list;
    va_start(list, number);
    long a[6];
    for (long& argument : a) {
        argument = va_arg(list, long);
    }
    va_end(list);
    const auto* until = reinterpret_cast<const timespec*>(a[3]);
    if (number != SYS_futex || (a[1] & FUTEX_CMD_MASK) != FUTEX_WAIT_BITSET ||
        (a[1] & FUTEX_CLOCK_REALTIME) == 0 || until == nullptr) {
        return real(number, a[0], a[1], a[2], a[3], a[4], a[5]);
    }
    for (;;) {
        const std::int64_t now = RealNow();
        const std::int64_t end = Nanoseconds(*until) - Offset()->load();
        const timespec slice = Timespec(std::max<std::int64_t>(std::min(end, now + kSlice), 0));
        const long result = real(number, a[0], a[1], a[2], &slice, a[4], a[5]);
        if (result == 0 || errno != ETIMEDOUT || end <= now + kSlice) {
            return result;
        }
    }
}

}  // extern "C"
