#pragma once
// Files that are complete or not there at all.
#include <filesystem>
#include <string>
#include <string_view>

namespace touchstone {

/// Writes a file beside its place and moves it there in close(), so that a full disk or a killed process leaves the
/// earlier file as it was. Where `file` names a link, the file it points to is replaced; where it names something other
/// than a regular file (a terminal, a pipe, /dev/null), the bytes go there directly.
/// What fails throws std::runtime_error: one sentence with `what` ("the report"), the file and the system's reason.
class OutputFile {
  public:
    OutputFile(std::filesystem::path file, std::string what);
    ~OutputFile();  ///< without close(): removes what was written
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    void write(std::string_view bytes);
    /// The file is in its place when this returns.
    void close();

  private:
    [[noreturn]] void fail() const;
    void flush();

    std::filesystem::path file_, target_, part_;  // part_ is empty where the bytes go to the target directly
    std::string what_, buffer_;
    int handle_ = -1;
};

/// All of a file at once.
void writeFile(const std::filesystem::path& file, const std::string& what, std::string_view bytes);

}  // namespace touchstone
