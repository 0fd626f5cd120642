#pragma once
// Writes files that are either complete or absent.
#include <filesystem>
#include <string>
#include <string_view>

namespace touchstone {

/// Writes to a temporary file in the same folder and renames it in close(), so that a full disk or a killed process
/// leaves the earlier file unchanged. If `file` is a link, the file that it points to is replaced. If it is not a
/// regular file (a terminal, a pipe, /dev/null), the bytes are written to it directly. Errors throw std::runtime_error
/// with one sentence that names `what` ("the report"), the file and the system's reason.
class OutputFile {
  public:
    OutputFile(std::filesystem::path file, std::string what);
    ~OutputFile();  ///< removes the temporary file if close() was not called
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    void write(std::string_view bytes);
    /// The file that close() renames: for a library that writes it itself, in place of write().
    const std::filesystem::path& temporary() const { return part_.empty() ? target_ : part_; }
    [[noreturn]] void fail() const;  ///< throws the sentence, with the reason in errno
    /// When it returns, the file is complete and has its name.
    void close();

  private:
    void flush();

    std::filesystem::path file_, target_, part_;  // part_ is the temporary file; empty if bytes go to the target
    std::string what_, buffer_;
    int handle_ = -1;
};

/// Writes a whole file at once.
void writeFile(const std::filesystem::path& file, const std::string& what, std::string_view bytes);

}  // namespace touchstone
