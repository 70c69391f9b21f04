#pragma once

#include <xmmintrin.h>

namespace relume::render {

// Default rounding, no traps, denormals taken for zero (they cost 100 cycles each) while it lives:
// the same on every thread, whatever the caller has set.
class FloatingPointMode {
  public:
    FloatingPointMode() : saved_(_mm_getcsr()) { _mm_setcsr(0x1f80 | 0x8040); }
    ~FloatingPointMode() { _mm_setcsr(saved_); }
    FloatingPointMode(const FloatingPointMode&) = delete;
    FloatingPointMode& operator=(const FloatingPointMode&) = delete;

  private:
    unsigned saved_;
};

}  // namespace relume::render
