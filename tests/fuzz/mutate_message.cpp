#include "tests/fuzz/mutate_message.h"

#include <cmath>
#include <iterator>
#include <limits>
#include <string>

namespace relume::test {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

class Mutator {
  public:
    explicit Mutator(std::mt19937_64* random) : random_(*random) {}

    void Mutate(Message* message) {
        const auto* type = message->GetDescriptor();
        if (type->field_count() == 0) {
            return;
        }
        const FieldDescriptor* field = type->field(static_cast<int>(Below(type->field_count())));
        const Reflection* reflection = message->GetReflection();
        if (Below(12) == 0) {
            reflection->ClearField(message, field);
        } else if (field->is_repeated()) {
            MutateRepeated(message, field);
        } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
            Mutate(reflection->MutableMessage(message, field));
        } else {
            Set(message, field);
        }
    }

  private:
    std::uint64_t Below(std::int64_t end) { return random_() % static_cast<std::uint64_t>(end); }

    std::int64_t Integer() {
        switch (Below(6)) {
            case 0:
                return static_cast<std::int64_t>(random_());
            case 1:
                return std::int64_t{1} << Below(63);
            case 2:
                return -(std::int64_t{1} << Below(63));
            case 3:
                return (std::int64_t{1} << Below(63)) - 1;
            default:
                return static_cast<std::int64_t>(Below(100));
        }
    }

    double Real() {
        constexpr double kReals[] = {0,     -0.0,   1,        -1,        1e-300,
                                     1e300, -1e300, HUGE_VAL, -HUGE_VAL, NAN,
                                     0.5,   8,      1048576,  1e38,      1152921504606846976.0};
        return Below(4) == 0 ? static_cast<double>(Integer()) : kReals[Below(std::size(kReals))];
    }

    std::string Text() {
        static const std::string texts[] = {"",
                                            ".",
                                            "..",
                                            "../x",
                                            "/x",
                                            "a/../b",
                                            "a\nb",
                                            std::string("a\0b", 3),
                                            "jobs/a",
                                            "scene.gltf",
                                            "adaptive",
                                            "uniform",
                                            "paper:mode=corrected",
                                            "auto:effort=1e999",
                                            "none",
                                            "rpf:neighbours=-1",
                                            "bilateral:mode=printed,x=nan",
                                            std::string(64, 'a'),
                                            std::string(3000, 'x')};
        if (Below(3) != 0) {
            return texts[Below(std::size(texts))];
        }
        std::string bytes(Below(300), '\0');
        for (char& byte : bytes) {
            byte = static_cast<char>(Below(128));  // proto3's strings are UTF-8
        }
        return bytes;
    }

    // Some bytes of what is there changed, or more or fewer of them.
    std::string Bytes(std::string bytes) {
        if (bytes.empty() || Below(4) == 0) {
            bytes.resize(Below(8000));
        }
        for (std::uint64_t n = Below(6); n > 0 && !bytes.empty(); --n) {
            bytes[Below(static_cast<std::int64_t>(bytes.size()))] = static_cast<char>(random_());
        }
        return bytes;
    }

    void Set(Message* m, const FieldDescriptor* f) {
        const Reflection* r = m->GetReflection();
        switch (f->cpp_type()) {
            case FieldDescriptor::CPPTYPE_INT32:
                return r->SetInt32(m, f, static_cast<std::int32_t>(Integer()));
            case FieldDescriptor::CPPTYPE_INT64:
                return r->SetInt64(m, f, Integer());
            case FieldDescriptor::CPPTYPE_UINT32:
                return r->SetUInt32(m, f, static_cast<std::uint32_t>(Integer()));
            case FieldDescriptor::CPPTYPE_UINT64:
                return r->SetUInt64(m, f, static_cast<std::uint64_t>(Integer()));
            case FieldDescriptor::CPPTYPE_DOUBLE:
                return r->SetDouble(m, f, Real());
            case FieldDescriptor::CPPTYPE_FLOAT:
                return r->SetFloat(m, f, static_cast<float>(Real()));
            case FieldDescriptor::CPPTYPE_BOOL:
                return r->SetBool(m, f, Below(2) == 0);
            case FieldDescriptor::CPPTYPE_ENUM:
                return r->SetEnumValue(m, f, static_cast<int>(Integer()));
            case FieldDescriptor::CPPTYPE_STRING:
                return r->SetString(
                    m, f,
                    f->type() == FieldDescriptor::TYPE_BYTES ? Bytes(r->GetString(*m, f)) : Text());
            case FieldDescriptor::CPPTYPE_MESSAGE:
                return;
        }
    }

    void MutateRepeated(Message* m, const FieldDescriptor* f) {
        const Reflection* r = m->GetReflection();
        const int size = r->FieldSize(*m, f);
        if (size > 0 && Below(4) == 0) {
            r->RemoveLast(m, f);
        } else if (f->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
            Mutate(size > 0 && Below(2) == 0
                       ? r->MutableRepeatedMessage(m, f, static_cast<int>(Below(size)))
                       : r->AddMessage(m, f));
        } else if (f->cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
            r->AddString(m, f, Text());
        } else if (f->cpp_type() == FieldDescriptor::CPPTYPE_UINT32) {
            r->AddUInt32(m, f, static_cast<std::uint32_t>(Integer()));
        } else if (f->cpp_type() == FieldDescriptor::CPPTYPE_UINT64) {
            r->AddUInt64(m, f, static_cast<std::uint64_t>(Integer()));
        }
    }

    std::mt19937_64& random_;
};

}  // namespace

void MutateMessage(std::mt19937_64* random, google::protobuf::Message* message) {
    Mutator mutator(random);
    for (std::uint64_t n = 1 + (*random)() % 4; n > 0; --n) {
        mutator.Mutate(message);
    }
}

}  // namespace relume::test
