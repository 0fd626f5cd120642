#pragma once
// Messages for the user of a running session.
#include <cstdint>
#include <string>
#include <vector>

namespace touchstone::sandbox {

struct Message {
    enum class Kind { Note, Warning, Error };
    Kind kind = Kind::Note;
    std::string text;    ///< one sentence
    double seconds = 0;  ///< since the session began
};

/// Keeps the newest messages. One thread.
class MessageLog {
  public:
    MessageLog();

    /// Control characters of quoted names are escaped; a missing full stop is added.
    void say(Message::Kind kind, std::string text);
    const std::vector<Message>& messages() const { return messages_; }  ///< newest last
    double seconds() const;                                             ///< since the session began

  private:
    std::uint64_t began_;  ///< ns
    std::vector<Message> messages_;
};

}  // namespace touchstone::sandbox
