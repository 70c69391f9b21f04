#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace relume {

// Readers refuse pictures with more pixels than this before they allocate anything.
inline constexpr std::int64_t kMaxReadPixels = std::int64_t{1} << 28;

// Pixels as float32 planes with names ("R", "albedo.R", "Z"), linear Rec. 709 for colours.
// The planes cover the data window: `width` x `height` pixels whose top-left one is (x0, y0) of a
// display window of display_width x display_height (the full frame, of which a crop is a part).
class Image {
  public:
    Image() = default;
    Image(int width, int height, std::vector<std::string> channels = {});

    int width() const { return width_; }
    int height() const { return height_; }
    std::size_t pixel_count() const { return static_cast<std::size_t>(width_) * height_; }

    int x0() const { return x0_; }
    int y0() const { return y0_; }
    int display_width() const { return display_width_; }
    int display_height() const { return display_height_; }
    void SetWindow(int x0, int y0, int display_width, int display_height);

    const std::vector<std::string>& channels() const { return channels_; }
    bool Has(const std::string& channel) const { return Find(channel) >= 0; }
    // Index of a channel, -1 if there is none.
    int Find(const std::string& channel) const;
    // Adds a plane of zeros; throws kAlreadyExists if the name is taken.
    int Add(const std::string& channel);

    // Row-major from the top-left pixel. The name form throws kNotFound and lists the channels.
    std::span<float> Plane(int index) { return planes_[static_cast<std::size_t>(index)]; }
    std::span<const float> Plane(int index) const {
        return planes_[static_cast<std::size_t>(index)];
    }
    std::span<float> Plane(const std::string& channel);
    std::span<const float> Plane(const std::string& channel) const;

    // Text attributes, written to an EXR's header.
    std::map<std::string, std::string>& metadata() { return metadata_; }
    const std::map<std::string, std::string>& metadata() const { return metadata_; }

  private:
    int width_ = 0, height_ = 0;
    int x0_ = 0, y0_ = 0, display_width_ = 0, display_height_ = 0;
    std::vector<std::string> channels_;
    std::vector<std::vector<float>> planes_;
    std::map<std::string, std::string> metadata_;
};

// SHA-256 over the windows, the names of the channels and their bits in order of name; metadata
// does not count. Two renders of one job have the same digest.
std::string ImageDigest(const Image& image);

}  // namespace relume
