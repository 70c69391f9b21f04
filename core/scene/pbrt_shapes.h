#pragma once

#include <string>
#include <vector>

#include "core/scene/pbrt_document.h"
#include "core/scene/scene.h"

// Shapes of a pbrt file as triangles. Their front is pbrt's side of the normal: that of "normal N"
// where a mesh has it, else the counter-clockwise one of triangles and the outside of quadrics;
// ReverseOrientation turns it round. v of texture coordinates is turned to run down, as in Scene.
namespace relume::pbrt {

// False for a type that pbrt has but Relume lacks, or that nobody knows.
bool IsSupportedShape(const std::string& type);

// Fills in all of `mesh` but its material and name. `shapes` is one shape, or several curves of
// equal state. Reads the file of a plymesh. May leave the mesh without triangles. What it takes is
// counted by `room`, a shape's before it is made.
void MakeMesh(const std::vector<const Shape*>& shapes, const FileSource& files, Mesh* mesh,
              Notes* notes, ArrayRoom* room);

// Quadrics are made of unit size, so that many share one mesh: where that mesh lies in the shape's
// space. Throws for a size of 0 or less.
Transform MeshToShape(const Shape& shape);
// Shapes of equal keys have equal meshes, but for the material; "" = of its own.
std::string ShareKey(const Shape& shape);

// The file that a plymesh reads.
std::string PlyName(const Shape& shape);

// Texture coordinates as pbrt has them for triangles without: (0,0) (1,0) (1,1). Corners are
// unshared for it.
void AddDefaultUvs(Mesh* mesh, ArrayRoom* room);

// Of the quadrics sphere, disk and cylinder, of unit size.
//   sphere: 128 x 64 facets, within 0.0006 radii of the true surface, with its normals
//   disk: 128 sectors of exactly the true area, within 0.0005 radii of the true rim
//   cylinder: 128 facets, within 0.0003 radii, with its normals
void MakeQuadric(const Declared& shape, Mesh* mesh);

// A Bezier or B-spline curve of degree 2 or 3: cylinders, and flat curves (which turn to the
// viewer), as tubes of 5 sides; ribbons as strips. Appended to `mesh`.
void AddCurve(const Declared& shape, Mesh* mesh, Notes* notes, ArrayRoom* room);

}  // namespace relume::pbrt
