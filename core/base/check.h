#pragma once

#include <fmt/format.h>

#include <cstdlib>

#include "core/base/log.h"

// Broken invariants of our own, never bad input (that is an Error): logs both values and aborts.
#define RELUME_CHECK(condition)                                                            \
    do {                                                                                   \
        if (!(condition)) {                                                                \
            ::spdlog::critical("{}:{}: check failed: {}", __FILE__, __LINE__, #condition); \
            std::abort();                                                                  \
        }                                                                                  \
    } while (false)

#define RELUME_CHECK_EQ(a, b)                                                             \
    do {                                                                                  \
        const auto& check_a = (a);                                                        \
        const auto& check_b = (b);                                                        \
        if (!(check_a == check_b)) {                                                      \
            ::spdlog::critical("{}:{}: check failed: {} == {} ({} against {})", __FILE__, \
                               __LINE__, #a, #b, check_a, check_b);                       \
            std::abort();                                                                 \
        }                                                                                 \
    } while (false)
