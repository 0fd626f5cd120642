#include "haptics/sandbox/session/message_log.hpp"

#include <utility>

#include "engine/scene/scene.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone::sandbox {
namespace {

constexpr std::size_t kMaxMessages = 200;

std::string asSentence(std::string text) {
    if (!text.empty() && text.back() != '.' && text.back() != '?') text += '.';
    return text;
}

}  // namespace

MessageLog::MessageLog() : began_(steadyNanoseconds()) {}

double MessageLog::seconds() const { return static_cast<double>(steadyNanoseconds() - began_) * 1e-9; }

void MessageLog::say(Message::Kind kind, std::string text) {
    if (messages_.size() == kMaxMessages) messages_.erase(messages_.begin());
    messages_.push_back({kind, engine::escaped(asSentence(std::move(text))), seconds()});
}

}  // namespace touchstone::sandbox
