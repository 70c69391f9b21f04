#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "core/base/error.h"
#include "core/scene/gltf.h"
#include "core/scene/uri.h"

namespace relume::gltf {
namespace {

// Accessors without a buffer view are zeros (section 3.6.2.3): their count is bounded by nothing
// else.
constexpr std::uint64_t kMaxZeros = std::uint64_t{1} << 26;

int ComponentSize(int component_type) {
    switch (component_type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return 1;
        case TINYGLTF_COMPONENT_TYPE_SHORT:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return 2;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        case TINYGLTF_COMPONENT_TYPE_FLOAT:
            return 4;
        default:
            return 0;
    }
}

}  // namespace

// A run of elements in a buffer, wholly inside it.
struct Data::Elements {
    const char* first = nullptr;
    std::size_t stride = 0;  // bytes
    std::size_t count = 0;

    template <class T>
    T Get(std::size_t element, int component) const {
        T value;
        std::memcpy(&value,
                    first + element * stride + static_cast<std::size_t>(component) * sizeof(T),
                    sizeof(T));
        return value;
    }

    template <class T>
    void AppendFloats(int components, bool normalized, std::vector<float>* out) const {
        const float one = normalized ? static_cast<float>(std::numeric_limits<T>::max()) : 1.0f;
        for (std::size_t i = 0; i < count; ++i) {
            for (int c = 0; c < components; ++c) {
                const float value = static_cast<float>(Get<T>(i, c));
                out->push_back(normalized ? std::max(value / one, -1.0f) : value);
            }
        }
    }

    template <class T>
    void AppendIndices(std::vector<std::uint32_t>* out) const {
        for (std::size_t i = 0; i < count; ++i) {
            out->push_back(Get<T>(i, 0));
        }
    }

    std::vector<float> Floats(int component_type, int components, bool normalized,
                              const SourceLocation& place) const {
        std::vector<float> out;
        out.reserve(count * static_cast<std::size_t>(components));
        switch (component_type) {
            case TINYGLTF_COMPONENT_TYPE_FLOAT:
                AppendFloats<float>(components, false, &out);
                break;
            case TINYGLTF_COMPONENT_TYPE_BYTE:
                AppendFloats<std::int8_t>(components, normalized, &out);
                break;
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
                AppendFloats<std::uint8_t>(components, normalized, &out);
                break;
            case TINYGLTF_COMPONENT_TYPE_SHORT:
                AppendFloats<std::int16_t>(components, normalized, &out);
                break;
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
                AppendFloats<std::uint16_t>(components, normalized, &out);
                break;
            default:
                Fail(place,
                     fmt::format("component type {} is not allowed here; export the scene again",
                                 component_type));
        }
        return out;
    }

    std::vector<std::uint32_t> Indices(int component_type, const SourceLocation& place) const {
        std::vector<std::uint32_t> out;
        out.reserve(count);
        switch (component_type) {
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
                AppendIndices<std::uint8_t>(&out);
                break;
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
                AppendIndices<std::uint16_t>(&out);
                break;
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
                AppendIndices<std::uint32_t>(&out);
                break;
            default:
                Fail(place,
                     fmt::format("component type {} can't hold indices; export the scene again",
                                 component_type));
        }
        return out;
    }
};

Data::Data(Document* document, const FileSource& files, std::uint64_t most_bytes)
    : document_(*document), room_(most_bytes) {
    const auto buffers = std::make_shared<std::vector<std::string>>();
    buffers_ = buffers;
    for (std::size_t i = 0; i < document->buffers.size(); ++i) {
        Document::Buffer& buffer = document->buffers[i];
        const SourceLocation place = document->Place("buffer", i, "");
        std::string file = "the binary chunk";
        std::string bytes;
        if (buffer.uri.empty()) {
            bytes = std::exchange(document->binary_chunk, std::string());
        } else if (IsDataUri(buffer.uri)) {
            file = "its data URI";
            bytes = DecodeDataUri(std::exchange(buffer.uri, std::string()), place);
        } else {
            file = UriToName(buffer.uri, place);
            try {
                bytes = files.Read(file);
            } catch (const Error& error) {
                throw Error(error.code(), fmt::format("{}: {}", place, error.what()));
            }
        }
        if (bytes.size() < buffer.byte_length) {
            throw Error(
                ErrorCode::kDataLoss,
                fmt::format(
                    "{}: {} is truncated: has {} bytes, the scene needs {}; restore the file",
                    place, file, bytes.size(), buffer.byte_length));
        }
        buffers->push_back(std::move(bytes));
    }
}

std::string_view Data::View(int buffer_view, const SourceLocation& place) const {
    const auto& view = At(document_.model.bufferViews, buffer_view, place, "buffer view");
    const std::string& buffer = At(*buffers_, view.buffer, place, "buffer");
    if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset) {
        Fail(place,
             fmt::format(
                 "buffer view {} ends at byte {} of {} in buffer {}; export the scene again",
                 buffer_view, view.byteOffset + view.byteLength, buffer.size(), view.buffer));
    }
    return std::string_view(buffer).substr(view.byteOffset, view.byteLength);
}

Data::Elements Data::Resolve(int buffer_view, std::uint64_t byte_offset, std::uint64_t count,
                             int component_type, int components,
                             const SourceLocation& place) const {
    const std::string_view bytes = View(buffer_view, place);
    const std::uint64_t size = static_cast<std::uint64_t>(ComponentSize(component_type)) *
                               static_cast<std::uint64_t>(components);
    if (size == 0) {
        Fail(place,
             fmt::format("component type {} is not known; export the scene again", component_type));
    }
    const std::uint64_t given =
        document_.model.bufferViews[static_cast<std::size_t>(buffer_view)].byteStride;
    const std::uint64_t stride = given == 0 ? size : given;
    // Careful with the order: numbers from the file may be huge.
    if (count > 0 && (byte_offset > bytes.size() || size > bytes.size() - byte_offset ||
                      count - 1 > (bytes.size() - byte_offset - size) / stride)) {
        throw Error(
            ErrorCode::kDataLoss,
            fmt::format(
                "{}: its {} elements do not fit into the {} bytes of buffer view {}; restore "
                "the file or export it again",
                place, count, bytes.size(), buffer_view));
    }
    return {bytes.data() + byte_offset, static_cast<std::size_t>(stride),
            static_cast<std::size_t>(count)};
}

const tinygltf::Accessor& Data::CheckedAccessor(int accessor, int components,
                                                const SourceLocation& place) const {
    const auto& item = At(document_.model.accessors, accessor, place, "accessor");
    const int has = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(item.type));
    if (has != components) {
        Fail(place, fmt::format(
                        "accessor {} has {} components where {} are needed; export the scene again",
                        accessor, has, components));
    }
    return item;
}

void Data::Count(std::uint64_t elements, int components, const SourceLocation& place) const {
    const std::uint64_t size = static_cast<std::uint64_t>(components) * sizeof(float);
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
    room_.Take(elements > kMost / size ? kMost : elements * size, [&] { return place; });
}

std::vector<float> Data::Floats(int accessor, int components, const SourceLocation& place) const {
    const auto& item = CheckedAccessor(accessor, components, place);
    Count(item.count, components, place);
    std::vector<float> values;
    if (item.bufferView >= 0) {
        values = Resolve(item.bufferView, item.byteOffset, item.count, item.componentType,
                         components, place)
                     .Floats(item.componentType, components, item.normalized, place);
    } else {
        if (!item.sparse.isSparse || item.count > kMaxZeros) {
            Fail(place, fmt::format("accessor {} has no data; export the scene again", accessor));
        }
        values.resize(item.count * static_cast<std::size_t>(components));
    }
    if (item.sparse.isSparse) {
        ApplySparse(item, components, place, &values);
    }
    return values;
}

void Data::ApplySparse(const tinygltf::Accessor& accessor, int components,
                       const SourceLocation& place, std::vector<float>* values) const {
    const auto& sparse = accessor.sparse;
    if (sparse.count < 0 || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0) {
        Fail(place, "its sparse accessor is malformed; export the scene again");
    }
    const auto count = static_cast<std::uint64_t>(sparse.count);
    const std::vector<std::uint32_t> where =
        Resolve(sparse.indices.bufferView, static_cast<std::uint64_t>(sparse.indices.byteOffset),
                count, sparse.indices.componentType, 1, place)
            .Indices(sparse.indices.componentType, place);
    const std::vector<float> what =
        Resolve(sparse.values.bufferView, static_cast<std::uint64_t>(sparse.values.byteOffset),
                count, accessor.componentType, components, place)
            .Floats(accessor.componentType, components, accessor.normalized, place);
    const auto n = static_cast<std::size_t>(components);
    for (std::size_t i = 0; i < where.size(); ++i) {
        if (where[i] >= accessor.count) {
            Fail(place, fmt::format("sparse index {} of {} is out of range; export the scene again",
                                    where[i], accessor.count));
        }
        std::copy_n(what.begin() + static_cast<std::ptrdiff_t>(i * n), n,
                    values->begin() + static_cast<std::ptrdiff_t>(where[i] * n));
    }
}

std::vector<std::uint32_t> Data::Indices(int accessor, const SourceLocation& place) const {
    const auto& item = CheckedAccessor(accessor, 1, place);
    if (item.sparse.isSparse || item.bufferView < 0) {
        Fail(place, "sparse indices are not supported; export the scene without them");
    }
    Count(item.count, 1, place);
    return Resolve(item.bufferView, item.byteOffset, item.count, item.componentType, 1, place)
        .Indices(item.componentType, place);
}

}  // namespace relume::gltf
