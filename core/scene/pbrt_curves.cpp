#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/math/frame.h"
#include "core/scene/pbrt_shapes.h"

namespace relume::pbrt {
namespace {

constexpr int kSteps = 6, kSides = 5;  // along one segment; around a tube

using Bezier = std::array<Vec3f, 4>;

// The cubic Bezier segments of a "curve" shape.
std::vector<Bezier> Segments(const Declared& shape, const std::vector<Vec3f>& p) {
    const std::string basis = shape.params.String("basis", "bezier");
    const int degree = shape.params.Int("degree", 3);
    if ((basis != "bezier" && basis != "bspline") || (degree != 2 && degree != 3)) {
        Fail(shape.place, fmt::format("curves are of basis bezier or bspline and degree 2 or 3, "
                                      "not {} and {}",
                                      basis, degree));
    }
    const auto d = static_cast<std::size_t>(degree);
    const bool bezier = basis == "bezier";
    if (p.size() < d + 1 || (bezier && (p.size() - 1) % d != 0)) {
        Fail(shape.place, fmt::format("a {} curve of degree {} can't have {} points; correct it",
                                      basis, degree, p.size()));
    }
    std::vector<Bezier> segments;
    for (std::size_t i = 0; i + d < p.size(); i += bezier ? d : 1) {
        if (degree == 2) {
            const Vec3f a = bezier ? p[i] : (p[i] + p[i + 1]) * 0.5f;
            const Vec3f b = p[i + 1];
            const Vec3f c = bezier ? p[i + 2] : (p[i + 1] + p[i + 2]) * 0.5f;
            segments.push_back({a, Lerp(2.0f / 3, a, b), Lerp(1.0f / 3, b, c), c});
        } else if (bezier) {
            segments.push_back({p[i], p[i + 1], p[i + 2], p[i + 3]});
        } else {
            const Vec3f b = Lerp(1.0f / 3, p[i + 1], p[i + 2]);
            const Vec3f c = Lerp(2.0f / 3, p[i + 1], p[i + 2]);
            segments.push_back({(Lerp(2.0f / 3, p[i], p[i + 1]) + b) * 0.5f, b, c,
                                (c + Lerp(1.0f / 3, p[i + 2], p[i + 3])) * 0.5f});
        }
    }
    return segments;
}

Vec3f Evaluate(const Bezier& b, float t, Vec3f* tangent) {
    const Vec3f p01 = Lerp(t, b[0], b[1]), p12 = Lerp(t, b[1], b[2]), p23 = Lerp(t, b[2], b[3]);
    const Vec3f p012 = Lerp(t, p01, p12), p123 = Lerp(t, p12, p23);
    *tangent = p123 - p012;
    if (!(Length2(*tangent) > 0)) {
        *tangent = b[3] - b[0];
    }
    return Lerp(t, p012, p123);
}

// Vertices across the curve at one place; `side` is a unit vector across it.
struct Ring {
    Vec3f center, tangent, side;
    float radius, u;
};

void AddTubeRing(const Ring& ring, Mesh* mesh) {
    const Vec3f other = Cross(ring.tangent, ring.side);
    for (int i = 0; i < kSides; ++i) {
        const float v = static_cast<float>(i) / static_cast<float>(kSides);
        const Vec3f n = ring.side * std::cos(2 * kPi * v) + other * std::sin(2 * kPi * v);
        mesh->positions.push_back(ring.center + n * ring.radius);
        mesh->normals.push_back(n);
        mesh->uvs.push_back({ring.u, v});
    }
}

void AddRibbonRing(const Ring& ring, Vec3f normal, Mesh* mesh) {
    const Vec3f across = Normalize(Cross(ring.tangent, normal));
    for (int i = 0; i < 2; ++i) {
        mesh->positions.push_back(ring.center + across * (i == 0 ? -ring.radius : ring.radius));
        mesh->normals.push_back(normal);
        mesh->uvs.push_back({ring.u, static_cast<float>(i)});
    }
}

// Between the last two rings of `count` vertices each.
void AddBand(std::uint32_t count, bool closed, Mesh* mesh) {
    const auto end = static_cast<std::uint32_t>(mesh->positions.size());
    const std::uint32_t a = end - 2 * count, b = end - count;
    for (std::uint32_t i = 0; i < (closed ? count : count - 1); ++i) {
        const std::uint32_t j = (i + 1) % count;
        mesh->triangles.push_back({a + i, a + j, b + i});
        mesh->triangles.push_back({a + j, b + j, b + i});
    }
}

}  // namespace

void AddCurve(const Declared& shape, Mesh* mesh, Notes* notes, ArrayRoom* room) {
    const Params& params = shape.params;
    const std::string type = params.String("type", "flat");
    const float width = params.Float("width", 1);
    const float width0 = params.Float("width0", width), width1 = params.Float("width1", width);
    params.Ignore("splitdepth");
    if (type != "flat" && type != "cylinder" && type != "ribbon") {
        Fail(shape.place,
             fmt::format("curves are of type flat, cylinder or ribbon, not '{}'", type));
    }
    if (type == "flat") {
        notes->Add(shape.place, "flat curves, which turn to the viewer, are rendered as tubes");
    }
    const std::vector<Bezier> segments = Segments(shape, params.Points("P"));
    const std::vector<Vec3f> normals = params.Points("N");
    const bool ribbon = type == "ribbon";
    if (ribbon && normals.size() != segments.size() + 1) {
        Fail(shape.place, fmt::format("a ribbon of {} segments must have {} normals N, not {}",
                                      segments.size(), segments.size() + 1, normals.size()));
    }
    const std::uint64_t around = ribbon ? 2 : kSides;
    room->Take((segments.size() * kSteps + 1) * around *
                   (2 * sizeof(Vec3f) + sizeof(Vec2f) + 2 * sizeof(Vec3u)),
               [&] { return shape.place.Text(); });
    Vec3f side;
    const int total = static_cast<int>(segments.size()) * kSteps;
    for (int i = 0; i <= total; ++i) {
        const int segment = std::min(i / kSteps, static_cast<int>(segments.size()) - 1);
        const float t = static_cast<float>(i - segment * kSteps) / kSteps;
        Ring ring;
        ring.u = static_cast<float>(i) / static_cast<float>(total);
        ring.radius = 0.5f * (width0 * (1 - ring.u) + width1 * ring.u);
        ring.center = Evaluate(segments[static_cast<std::size_t>(segment)], t, &ring.tangent);
        const float length = Length(ring.tangent);
        ring.tangent = length > 0 ? ring.tangent / length : Vec3f{0, 0, 1};
        // The last ring's side, made perpendicular: the tube does not twist.
        side = i == 0 ? Frame::FromZ(ring.tangent).x : Frame::FromZX(ring.tangent, side).x;
        ring.side = side;
        if (ribbon) {
            const auto s = static_cast<std::size_t>(segment);
            const Vec3f n = Lerp(t, Normalize(normals[s]), Normalize(normals[s + 1]));
            // Across the curve and close to N.
            const Vec3f across = Cross(n, ring.tangent);
            const bool known = Length2(across) > 1e-12f;
            AddRibbonRing(ring, known ? Normalize(Cross(ring.tangent, across)) : side, mesh);
        } else {
            AddTubeRing(ring, mesh);
        }
        if (i > 0) {
            AddBand(ribbon ? 2 : kSides, !ribbon, mesh);
        }
    }
}

}  // namespace relume::pbrt
