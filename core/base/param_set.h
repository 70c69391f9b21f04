#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace relume {

// Named parameters of one thing that a registry makes (material, light, camera, filter, sampler):
// the loader or command line fills it, the thing itself reads it, and what nobody read is a
// misspelling.
class ParamSet {
  public:
    using Value = std::variant<bool, std::vector<float>, std::string>;

    void Set(const std::string& name, bool value) { values_[name] = value; }
    void Set(const std::string& name, float value) { values_[name] = std::vector<float>{value}; }
    void Set(const std::string& name, std::vector<float> value) {
        values_[name] = std::move(value);
    }
    void Set(const std::string& name, std::string value) { values_[name] = std::move(value); }
    void Set(const std::string& name, const char* value) { values_[name] = std::string(value); }

    bool Has(const std::string& name) const { return values_.count(name) != 0; }

    // The value, or the default if absent. A value of another kind or length throws
    // kInvalidArgument with the parameter's name. Text that spells a number or a bool is taken as
    // such (command lines).
    bool GetBool(const std::string& name, bool otherwise) const;
    float GetFloat(const std::string& name, float otherwise) const;
    int GetInt(const std::string& name, int otherwise) const;
    std::string GetString(const std::string& name, const std::string& otherwise) const;
    std::vector<float> GetFloats(const std::string& name,
                                 const std::vector<float>& otherwise) const;
    // One of `known`, else throws with the known ones listed.
    std::string GetChoice(const std::string& name, const std::string& otherwise,
                          const std::vector<std::string>& known) const;

    // Throws kInvalidArgument if a parameter was set that no Get asked for: names it, `owner` and
    // those that were asked for.
    void RejectUnused(const std::string& owner) const;
    std::vector<std::string> Unused() const;

    const std::map<std::string, Value>& values() const { return values_; }

  private:
    const Value* Find(const std::string& name) const;

    std::map<std::string, Value> values_;
    mutable std::set<std::string> asked_;
};

// "name:key=value,key=value" as given to --filter and --sampler.
struct NamedParams {
    std::string name;
    ParamSet params;
};
NamedParams ParseNamedParams(std::string_view text);

}  // namespace relume
