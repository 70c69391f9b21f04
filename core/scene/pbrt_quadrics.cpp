#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/scene/pbrt_shapes.h"

namespace relume::pbrt {
namespace {

constexpr int kAround = 128, kAlong = 64;

struct Quadric {
    float radius, phi_max;                 // radians
    float theta_min = kPi, theta_max = 0;  // sphere: from the south pole (v = 0) up
    float inner = 0, height = 0;           // disk: inner over outer radius
    float z_min = 0, z_max = 0;            // cylinder

    Quadric(const Declared& shape) {
        const Params& params = shape.params;
        radius = params.Float("radius", 1);
        phi_max = std::clamp(params.Float("phimax", 360), 0.0f, 360.0f) * (kPi / 180);
        if (!(radius > 0) || !(phi_max > 0)) {
            Fail(shape.place, fmt::format("a {} of radius {} and phimax {} has no surface; "
                                          "correct or remove it",
                                          shape.type, radius, phi_max * (180 / kPi)));
        }
        if (shape.type == "sphere") {
            const float a = std::clamp(params.Float("zmin", -radius), -radius, radius);
            const float b = std::clamp(params.Float("zmax", radius), -radius, radius);
            theta_min = std::acos(std::min(a, b) / radius);
            theta_max = std::acos(std::max(a, b) / radius);
        } else if (shape.type == "disk") {
            height = params.Float("height", 0);
            inner = params.Float("innerradius", 0) / radius;
        } else {
            const float a = params.Float("zmin", -1), b = params.Float("zmax", 1);
            z_min = std::min(a, b);
            z_max = std::max(a, b);
        }
        if (!(inner >= 0) || !(inner < 1) || (shape.type == "sphere" && theta_min <= theta_max) ||
            (shape.type == "cylinder" && z_max <= z_min)) {
            Fail(shape.place, fmt::format("this {} has no surface (its limits leave nothing); "
                                          "correct or remove it",
                                          shape.type));
        }
    }

    // Facets around, so that a whole turn has kAround.
    int Columns() const {
        return std::max(3, static_cast<int>(std::ceil(kAround * phi_max / (2 * kPi) - 1e-4f)));
    }
};

// A grid of (columns + 1) x (rows + 1) vertices; u runs with columns, v (up) with rows. Facets of
// no size (at poles) are left out.
void AddGrid(int columns, int rows, Mesh* mesh) {
    const auto at = [&](int column, int row) {
        return static_cast<std::uint32_t>(row * (columns + 1) + column);
    };
    const auto same = [&](std::uint32_t a, std::uint32_t b) {
        return Length2(mesh->positions[a] - mesh->positions[b]) < 1e-12f;
    };
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const std::uint32_t a = at(column, row), b = at(column + 1, row),
                                c = at(column + 1, row + 1), d = at(column, row + 1);
            if (!same(a, b)) {
                mesh->triangles.push_back({a, b, c});
            }
            if (!same(c, d)) {
                mesh->triangles.push_back({a, c, d});
            }
        }
    }
}

void MakeSphere(const Quadric& q, Mesh* mesh) {
    const int columns = q.Columns();
    const float span = q.theta_min - q.theta_max;
    const int rows = std::max(2, static_cast<int>(std::ceil(kAlong * span / kPi - 1e-4f)));
    for (int row = 0; row <= rows; ++row) {
        const float v = static_cast<float>(row) / static_cast<float>(rows);
        const float theta = q.theta_min - v * span;
        // Exactly 0 at the poles, so that AddGrid sees them.
        const float z = std::cos(theta);
        const float ring = theta >= kPi || theta <= 0 ? 0 : std::sin(theta);
        for (int column = 0; column <= columns; ++column) {
            const float u = static_cast<float>(column) / static_cast<float>(columns);
            const float phi = column == columns && q.phi_max >= 2 * kPi ? 0 : u * q.phi_max;
            const Vec3f p{ring * std::cos(phi), ring * std::sin(phi), z};
            mesh->positions.push_back(p);
            mesh->normals.push_back(Normalize(p));
            mesh->uvs.push_back({u, v});
        }
    }
    AddGrid(columns, rows, mesh);
}

void MakeCylinder(const Quadric& q, Mesh* mesh) {
    const int columns = q.Columns();
    for (int row = 0; row <= 1; ++row) {
        for (int column = 0; column <= columns; ++column) {
            const float u = static_cast<float>(column) / static_cast<float>(columns);
            const float phi = u * q.phi_max;
            const Vec3f n{std::cos(phi), std::sin(phi), 0};
            mesh->positions.push_back({n.x, n.y, static_cast<float>(row)});
            mesh->normals.push_back(n);
            mesh->uvs.push_back({u, static_cast<float>(row)});
        }
    }
    AddGrid(columns, 1, mesh);
}

void MakeDisk(const Quadric& q, Mesh* mesh) {
    const int columns = q.Columns();
    const double step = static_cast<double>(q.phi_max) / columns;
    // A sector's triangle of radius r has the area r^2 sin(step) / 2; the sector's is step / 2.
    const auto outer = static_cast<float>(std::sqrt(step / std::sin(step)));
    // v is 0 at the rim and 1 inside; rows run with v, and u the other way for the front to be +z.
    for (int row = 0; row <= 1; ++row) {
        const float r = row == 0 ? outer : q.inner * outer;
        for (int column = 0; column <= columns; ++column) {
            const float u = static_cast<float>(column) / static_cast<float>(columns);
            const float phi = u * q.phi_max;
            mesh->positions.push_back({r * std::cos(phi), r * std::sin(phi), 0});
            mesh->uvs.push_back({u, static_cast<float>(row)});
        }
    }
    AddGrid(columns, 1, mesh);
}

bool IsQuadric(const std::string& type) {
    return type == "sphere" || type == "disk" || type == "cylinder";
}

}  // namespace

void MakeQuadric(const Declared& shape, Mesh* mesh) {
    const Quadric quadric(shape);
    if (shape.type == "sphere") {
        MakeSphere(quadric, mesh);
    } else if (shape.type == "disk") {
        MakeDisk(quadric, mesh);
    } else {
        MakeCylinder(quadric, mesh);
    }
}

Transform MeshToShape(const Shape& shape) {
    if (!IsQuadric(shape.is.type)) {
        return {};
    }
    const Quadric q(shape.is);
    if (shape.is.type == "sphere") {
        return Transform::Scale({q.radius, q.radius, q.radius});
    }
    if (shape.is.type == "disk") {
        return Transform::Translate({0, 0, q.height}) * Transform::Scale({q.radius, q.radius, 1});
    }
    return Transform::Translate({0, 0, q.z_min}) *
           Transform::Scale({q.radius, q.radius, q.z_max - q.z_min});
}

std::string ShareKey(const Shape& shape) {
    if (!IsQuadric(shape.is.type)) {
        return "";
    }
    const Quadric q(shape.is);
    return fmt::format("{} {} {} {} {} {}", shape.is.type, q.phi_max, q.theta_min, q.theta_max,
                       q.inner, shape.reverse);
}

}  // namespace relume::pbrt
