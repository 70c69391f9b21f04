#include "core/scene/polygon.h"

#include <cmath>
#include <numeric>

// By cutting off ears: corners whose triangle has no other corner inside (Meisters, "Polygons have
// ears", 1975), in the plane across the axis that the polygon faces most.

namespace relume {
namespace {

struct Point {
    double x, y;
};

// Twice the signed area.
double Area(Point a, Point b, Point c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool Inside(Point p, Point a, Point b, Point c) {
    return Area(a, b, p) >= 0 && Area(b, c, p) >= 0 && Area(c, a, p) >= 0;
}

// Seen so that it turns counter-clockwise.
std::vector<Point> Project(const std::vector<Vec3f>& corners) {
    double n[3] = {0, 0, 0};  // Newell's normal
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec3f &p = corners[i], &q = corners[(i + 1) % corners.size()];
        n[0] += (double{p.y} - q.y) * (double{p.z} + q.z);
        n[1] += (double{p.z} - q.z) * (double{p.x} + q.x);
        n[2] += (double{p.x} - q.x) * (double{p.y} + q.y);
    }
    const int axis = std::abs(n[0]) > std::abs(n[1]) ? (std::abs(n[0]) > std::abs(n[2]) ? 0 : 2)
                                                     : (std::abs(n[1]) > std::abs(n[2]) ? 1 : 2);
    std::vector<Point> points;
    points.reserve(corners.size());
    for (const Vec3f& p : corners) {
        const Point point = axis == 0   ? Point{p.y, p.z}
                            : axis == 1 ? Point{p.z, p.x}
                                        : Point{p.x, p.y};
        points.push_back(n[axis] < 0 ? Point{-point.x, point.y} : point);
    }
    return points;
}

}  // namespace

void Triangulate(const std::vector<Vec3f>& corners, std::vector<Vec3u>* triangles) {
    const auto fan = [&](const std::vector<std::uint32_t>& left) {
        for (std::size_t i = 1; i + 1 < left.size(); ++i) {
            triangles->push_back({left[0], left[i], left[i + 1]});
        }
    };
    std::vector<std::uint32_t> left(corners.size());
    std::iota(left.begin(), left.end(), 0u);
    if (corners.size() <= 3 || corners.size() > kMostConcaveCorners) {
        fan(left);
        return;
    }
    const std::vector<Point> points = Project(corners);
    const auto turn = [&](std::size_t i) {
        const std::size_t n = left.size();
        return Area(points[left[(i + n - 1) % n]], points[left[i]], points[left[(i + 1) % n]]);
    };
    bool concave = true;
    while (left.size() > 3 && concave) {
        concave = false;
        for (std::size_t i = 0; i < left.size(); ++i) {
            concave = concave || turn(i) < 0;
        }
        const std::size_t n = left.size();
        std::size_t ear = n;
        for (std::size_t i = 0; i < n && concave && ear == n; ++i) {
            if (!(turn(i) > 0)) {
                continue;
            }
            const std::uint32_t before = left[(i + n - 1) % n], at = left[i],
                                after = left[(i + 1) % n];
            bool empty = true;
            for (std::size_t k = 0; k < n && empty; ++k) {
                const std::uint32_t other = left[k];
                empty = other == before || other == at || other == after || turn(k) > 0 ||
                        !Inside(points[other], points[before], points[at], points[after]);
            }
            ear = empty ? i : n;
        }
        if (ear == n) {
            break;  // convex, or crosses itself
        }
        triangles->push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    fan(left);
}

}  // namespace relume
