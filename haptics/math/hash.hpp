#pragma once
// FNV-1a over 64-bit words, and over single bytes for the rest: for checksums and keys, not for security.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>

namespace touchstone {

class Hash {
  public:
    Hash& add(const void* data, std::size_t size) {
        const auto* bytes = static_cast<const unsigned char*>(data);
        for (; size >= sizeof(std::uint64_t); size -= sizeof(std::uint64_t), bytes += sizeof(std::uint64_t)) {
            std::uint64_t word = 0;
            std::memcpy(&word, bytes, sizeof word);
            mix(word);
        }
        for (; size > 0; --size) mix(*bytes++);
        return *this;
    }
    template <class T>
    Hash& add(const T& value) {
        return add(&value, sizeof value);
    }
    std::uint64_t value() const { return value_; }

  private:
    void mix(std::uint64_t word) {
        value_ = (value_ ^ word) * 0x100000001b3u;
        value_ ^= value_ >> 32;  // so that the high bits of a word also affect the low bits
    }

    std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// Sixteen digits, as hashes are written in files.
inline std::string hexadecimal(std::uint64_t value) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
    return text;
}

}  // namespace touchstone
