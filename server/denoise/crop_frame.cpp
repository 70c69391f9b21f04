#include "server/denoise/crop_frame.h"

#include <algorithm>

namespace relume::denoise {
namespace {

template <class Values>
Values Crop(const Values& in, int width, const TileRect& rect) {
    Values out;
    if (in.empty()) {
        return out;
    }
    out.reserve(rect.area());
    for (int y = rect.y0; y < rect.y1; ++y) {
        const auto row = in.begin() + static_cast<std::ptrdiff_t>(y) * width;
        out.insert(out.end(), row + rect.x0, row + rect.x1);
    }
    return out;
}

}  // namespace

Plane CropPlane(const Plane& plane, int width, const TileRect& rect) {
    return Crop(plane, width, rect);
}

void PastePlane(const Plane& part, const TileRect& rect, int width, Plane* whole) {
    auto from = part.begin();
    for (int y = rect.y0; y < rect.y1; ++y, from += rect.width()) {
        std::copy_n(from, rect.width(),
                    whole->begin() + static_cast<std::ptrdiff_t>(y) * width + rect.x0);
    }
}

Frame CropFrame(const Frame& frame, const TileRect& rect) {
    const auto crop = [&](const Plane& plane) { return Crop(plane, frame.width, rect); };
    Frame out;
    out.width = rect.width();
    out.height = rect.height();
    for (std::size_t c = 0; c < 3; ++c) {
        out.color[c] = crop(frame.color[c]);
        out.variance[c] = crop(frame.variance[c]);
        out.sample_variance[c] = crop(frame.sample_variance[c]);
        for (std::size_t h = 0; h < 2; ++h) {
            out.half[h][c] = crop(frame.half[h][c]);
        }
    }
    out.count = crop(frame.count);
    out.brightest = crop(frame.brightest);
    for (std::size_t f = 0; f < kFeatureCount; ++f) {
        out.feature[f] = crop(frame.feature[f]);
        out.feature_variance[f] = crop(frame.feature_variance[f]);
        for (std::size_t h = 0; h < 2; ++h) {
            out.feature_half[h][f] = crop(frame.feature_half[h][f]);
        }
    }
    out.sampling = frame.sampling;
    out.flagged = Crop(frame.flagged, frame.width, rect);
    return out;
}

}  // namespace relume::denoise
