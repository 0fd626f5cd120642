#pragma once
// The ticks of a recording as one structured NumPy array in a file that can grow (.npy, version 1.0).
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "haptics/sandbox/record/tick_fields.hpp"

namespace touchstone::sandbox {

/// A descriptor of the system that is closed with its owner, also when the owner's constructor throws.
class FileHandle {
  public:
    explicit FileHandle(int descriptor) : descriptor_(descriptor) {}
    ~FileHandle();
    FileHandle(const FileHandle&) = delete;
    FileHandle& operator=(const FileHandle&) = delete;
    operator int() const { return descriptor_; }

  private:
    int descriptor_;
};

/// A file that is written at places. What fails throws std::runtime_error with one sentence that names the file and
/// gives the system's reason.
class RandomAccessFile {
  public:
    /// Pre: the file is not there yet, or `existing`.
    explicit RandomAccessFile(std::filesystem::path file, bool existing = false);
    void write(const std::string& bytes, std::uint64_t at);
    void cut(std::uint64_t size);
    std::uint64_t size() const;

  private:
    [[noreturn]] void fail(const char* what) const;
    std::filesystem::path file_;
    FileHandle handle_;
};

/// Appends rows. The file is whole after each flush(), also one that throws: rows first, then their number in the
/// header, whose length never changes.
class TickFileWriter {
  public:
    explicit TickFileWriter(const std::filesystem::path& file);
    void append(const RecordedTick& tick);
    void flush();
    std::uint64_t rows() const { return written_ + waiting(); }
    std::uint64_t waiting() const { return buffer_.size() / tickRowBytes(); }  ///< rows not flushed

  private:
    void countRows();

    RandomAccessFile file_;
    std::string buffer_;
    std::uint64_t written_ = 0;
};

/// Reads rows in order, of any recording that has the columns of the input; other columns that are not there stay at
/// their defaults. Throws std::runtime_error with one sentence naming the file when it is no such table or is cut off.
class TickFileReader {
  public:
    explicit TickFileReader(std::filesystem::path file);

    std::uint64_t rows() const { return rows_; }
    std::uint64_t row() const { return row_; }  ///< index of the next
    /// The columns that are there, in the table's order.
    const std::vector<const TickField*>& fields() const { return fields_; }
    /// Changes what the row holds of `tick`; false after the last.
    bool next(RecordedTick& tick);

  private:
    struct Place {
        const TickField* field;
        std::size_t offset;
    };
    [[noreturn]] void fail(const std::string& what) const;

    std::filesystem::path file_;
    FileHandle handle_;
    std::vector<const TickField*> fields_;
    std::vector<Place> columns_;
    std::uint64_t begin_ = 0, rows_ = 0, row_ = 0;
    std::size_t rowBytes_ = 0, bufferRow_ = 0;
    std::string buffer_;
};

struct TickFileRepair {
    std::uint64_t rowsBefore = 0, rows = 0;  ///< in the header before and now
    std::uint64_t cutBytes = 0;              ///< of a row that was not whole
};
/// Makes the header say how many whole rows there are, and cuts off what is left. A header that cannot be read is
/// written anew where `layout` is that of this program. Throws std::runtime_error with one sentence.
TickFileRepair repairTickFile(const std::filesystem::path& file, std::uint64_t layout);

/// Tells one table of fields from another.
std::uint64_t tickLayout();

}  // namespace touchstone::sandbox
