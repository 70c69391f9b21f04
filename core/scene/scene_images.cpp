#include "core/scene/scene_images.h"

#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/base/resources.h"
#include "core/image/decode.h"
#include "core/scene/image_header.h"

namespace relume {
namespace {

// Bytes that decoded pictures may take.
class Room {
  public:
    // False once they are too many.
    bool Take(const ImageSize& size) {
        const std::uint64_t bytes = static_cast<std::uint64_t>(size.width) *
                                    static_cast<std::uint64_t>(size.height) * 4 *
                                    (size.floats ? sizeof(float) : 1);
        taken_ += bytes;
        return fits();
    }
    bool fits() const { return taken_ <= most_; }
    std::uint64_t most() const { return most_; }

  private:
    const std::uint64_t most_ = AvailableResources().memory / 2;
    std::atomic<std::uint64_t> taken_{0};
};

SceneImage LoadImage(const FileSource& files, const ImageRequest& request, bool decode,
                     Room* room) {
    const std::string read = request.embedded ? std::string() : files.Read(request.name);
    const std::string& bytes = request.embedded ? request.bytes : read;
    SceneImage image;
    image.name = request.name;
    const ImageSize size = ReadImageHeader(bytes, request.name);
    image.width = size.width;
    image.height = size.height;
    if (decode && room->Take(size)) {
        DecodedImage decoded = DecodeImage(bytes, request.name);
        image.width = decoded.width;
        image.height = decoded.height;
        image.channels = decoded.channels;
        image.bytes = std::move(decoded.bytes);
        image.floats = std::move(decoded.floats);
    }
    return image;
}

// IEC 61966-2-1.
float SrgbToLinear(float c) {
    return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
}

void MakeLinear(SceneImage* image) {
    if (image->bytes.empty()) {
        return;
    }
    image->floats.reserve(image->bytes.size());
    for (const std::uint8_t byte : image->bytes) {
        image->floats.push_back(SrgbToLinear(static_cast<float>(byte) / 255.0f));
    }
    image->bytes.clear();
    image->bytes.shrink_to_fit();
}

}  // namespace

std::vector<SceneImage> LoadImages(const FileSource& files, std::vector<ImageRequest> requests,
                                   bool decode) {
    std::vector<SceneImage> images(requests.size());
    // Errors are kept by index: which one is told must not depend on threads.
    std::vector<std::optional<Error>> errors(requests.size());
    Room room;
    ParallelFor(0, requests.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            try {
                images[i] = LoadImage(files, requests[i], decode, &room);
                requests[i].bytes.clear();
            } catch (const Error& error) {
                errors[i] = error;
            }
        }
    });
    if (!room.fits()) {
        throw Error(
            ErrorCode::kResourceExhausted,
            fmt::format("the scene's {} pictures take more than {} MiB, half of this "
                        "machine's memory; make them smaller, or render on a larger machine",
                        requests.size(), room.most() >> 20));
    }
    for (std::size_t i = 0; i < requests.size(); ++i) {
        if (errors[i]) {
            throw Error(errors[i]->code(),
                        fmt::format("{}: {}", requests[i].wanted_by, errors[i]->what()));
        }
    }
    return images;
}

void AddEnvironment(const FileSource& files, const LoadOptions& options, Scene* scene) {
    if (options.environment.empty()) {
        return;
    }
    if (!std::isfinite(options.environment_scale) || options.environment_scale < 0) {
        ThrowInvalidArgument(
            fmt::format("environment scale {}: must be 0 or more", options.environment_scale));
    }
    std::vector<SceneImage> images = LoadImages(
        files, {{options.environment, "environment map", false, ""}}, options.decode_images);
    MakeLinear(&images.front());
    auto environment = std::make_shared<Environment>();
    environment->image = static_cast<int>(scene->images.size());
    environment->color = Rgb{1, 1, 1} * options.environment_scale;
    scene->images.push_back(std::move(images.front()));
    scene->environment = std::move(environment);
}

}  // namespace relume
