#pragma once

#include <functional>

#include "worker/render/accel/embree.h"

namespace relume::render {

// An Embree device of the numeric class, with errors turned into exceptions. Builds run in a task
// arena of fixed width: how Embree sorts triangles into leaves depends on the number of tasks, and
// with it which of two coincident triangles a ray meets. So the same structure is built whatever
// the machine.
class Device {
  public:
    Device();
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    RTCDevice get() const { return device_; }
    // Runs `build` in the arena, then throws what Embree reported.
    void Build(const std::function<void()>& build) const;

  private:
    RTCDevice device_ = nullptr;
};

}  // namespace relume::render
