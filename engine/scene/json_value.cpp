#include "engine/scene/json_value.hpp"

#include <nlohmann/json.hpp>
#include <utility>

namespace touchstone::engine {

JsonValue::JsonValue() : value_(std::make_unique<nlohmann::json>()) {}
JsonValue::JsonValue(const JsonValue& other) : value_(std::make_unique<nlohmann::json>(*other.value_)) {}
JsonValue::JsonValue(JsonValue&& other) noexcept : JsonValue() { std::swap(value_, other.value_); }
JsonValue& JsonValue::operator=(const JsonValue& other) {
    *value_ = *other.value_;
    return *this;
}
JsonValue& JsonValue::operator=(JsonValue&& other) noexcept {
    std::swap(value_, other.value_);
    return *this;
}
JsonValue::~JsonValue() = default;

void JsonValue::set(const nlohmann::json& value) { *value_ = value; }
void JsonValue::set(nlohmann::json&& value) { *value_ = std::move(value); }

bool operator==(const JsonValue& a, const JsonValue& b) { return *a.value_ == *b.value_; }

}  // namespace touchstone::engine
