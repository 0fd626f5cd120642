#pragma once
// Shared by the fuzz targets. A target is one function of bytes; libFuzzer or replay.cpp calls it.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace touchstone::fuzz {

/// Aborts the program, like a crash, unless the claim holds.
inline void require(bool claim, const std::string& what) {
    if (claim) return;
    std::fprintf(stderr, "broken: %s\n", what.c_str());
    std::abort();
}

/// Requires that an error is one sentence.
inline void requireSentence(const std::string& text) {
    require(!text.empty() && text.size() < 2000 && text.find('\n') == std::string::npos, "a sentence: " + text);
}

/// Takes bytes from the front; gives zeros after the end.
class Bytes {
  public:
    Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

    std::size_t left() const { return left_; }
    template <class T>
    T take() {
        T value{};
        const std::size_t n = left_ < sizeof value ? left_ : sizeof value;
        if (n) std::memcpy(&value, data_, n);  // without data there is no pointer to it
        data_ += n;
        left_ -= n;
        return value;
    }

  private:
    const std::uint8_t* data_;
    std::size_t left_;
};

/// A file of this process, removed at its end.
class ScratchFile {
  public:
    explicit ScratchFile(const std::string& extension)
        : path_(std::filesystem::temp_directory_path() /
                ("touchstone-fuzz-" + std::to_string(::getpid()) + extension)) {}
    ScratchFile(const ScratchFile&) = delete;
    ScratchFile& operator=(const ScratchFile&) = delete;
    ~ScratchFile() {
        std::error_code error;
        std::filesystem::remove(path_, error);
    }

    const std::filesystem::path& path() const { return path_; }
    const std::filesystem::path& write(const void* data, std::size_t size) const {
        std::ofstream out(path_, std::ios::binary | std::ios::trunc);
        out.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
        out.close();
        require(out.good(), "the scratch file is written");
        return path_;
    }

  private:
    std::filesystem::path path_;
};

}  // namespace touchstone::fuzz
