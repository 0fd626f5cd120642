#pragma once
// A JSON value as a member. Most files include the scene and never look into its JSON, so they need not
// compile the JSON library; only files that use the content include <nlohmann/json.hpp>.
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <type_traits>

namespace touchstone::engine {

/// Copies and compares like the nlohmann::json that it holds; null by default.
class JsonValue {
  public:
    JsonValue();
    /// A template, because brace initialization would otherwise differ from that of nlohmann::json.
    template <class Json>
    requires std::is_same_v<std::remove_cvref_t<Json>, nlohmann::json> JsonValue(Json&& value) : JsonValue() {
        set(static_cast<Json&&>(value));
    }
    JsonValue(const JsonValue& other);
    JsonValue(JsonValue&& other) noexcept;
    JsonValue& operator=(const JsonValue& other);
    JsonValue& operator=(JsonValue&& other) noexcept;
    ~JsonValue();

    nlohmann::json& operator*() { return *value_; }
    const nlohmann::json& operator*() const { return *value_; }
    nlohmann::json* operator->() { return value_.get(); }
    const nlohmann::json* operator->() const { return value_.get(); }
    friend bool operator==(const JsonValue& a, const JsonValue& b);

  private:
    void set(const nlohmann::json& value);
    void set(nlohmann::json&& value);

    std::unique_ptr<nlohmann::json> value_;  // never null
};

}  // namespace touchstone::engine
