#pragma once
// The ticks of a recording as one structured NumPy array in a file that can grow (.npy, version 1.0).
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "haptics/sandbox/record/tick_fields.hpp"

namespace touchstone::sandbox {

/// Owns a file descriptor. As a member it is closed even if the constructor of its class throws.
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

/// A file that is written at given offsets. Errors throw std::runtime_error with one sentence that names the file and
/// gives the system's reason.
class RandomAccessFile {
  public:
    /// Pre: the file does not exist yet, or `existing` is true.
    explicit RandomAccessFile(std::filesystem::path file, bool existing = false);
    void write(const std::string& bytes, std::uint64_t at);
    void cut(std::uint64_t size);
    std::uint64_t size() const;

  private:
    [[noreturn]] void fail(const char* what) const;
    std::filesystem::path file_;
    FileHandle handle_;
};

/// Appends rows. The file is valid after each flush(), even one that throws: rows are written first, then their number
/// in the header, whose length never changes.
class TickFileWriter {
  public:
    explicit TickFileWriter(const std::filesystem::path& file);
    void append(const RecordedTick& tick);
    void flush();
    std::uint64_t rows() const { return written_ + waiting(); }
    std::uint64_t waiting() const { return buffer_.size() / tickRowBytes(); }  ///< rows that are not flushed yet

  private:
    void countRows();

    RandomAccessFile file_;
    std::string buffer_;
    std::uint64_t written_ = 0;
};

/// Reads rows in order from any recording that has the columns of the input; other columns may be missing, and their
/// fields keep their defaults. Throws std::runtime_error with one sentence that names the file if it is not such a
/// table or is cut off.
class TickFileReader {
  public:
    explicit TickFileReader(std::filesystem::path file);

    std::uint64_t rows() const { return rows_; }
    std::uint64_t row() const { return row_; }  ///< index of the next row
    /// The columns that the file has, in the order of tickFields().
    const std::vector<const TickField*>& fields() const { return fields_; }
    /// Sets the fields of `tick` that the row holds; false after the last row.
    bool next(RecordedTick& tick);

  private:
    struct StoredField {
        const TickField* field;
        std::size_t offset;
    };
    [[noreturn]] void fail(const std::string& what) const;

    std::filesystem::path file_;
    FileHandle handle_;
    std::vector<const TickField*> fields_;
    std::vector<StoredField> columns_;
    std::uint64_t dataBegin_ = 0, rows_ = 0, row_ = 0;
    std::size_t rowBytes_ = 0, bufferRow_ = 0;
    std::string buffer_;
};

struct TickFileRepair {
    std::uint64_t rowsBefore = 0, rows = 0;  ///< number in the header, before and now
    std::uint64_t cutBytes = 0;              ///< of an incomplete last row
};
/// Sets the header to the number of complete rows and cuts off the rest. A header that cannot be read is rewritten if
/// `layout` is this program's tickLayout() and each of its bytes is zero or as in a header of ticks. Throws
/// std::runtime_error with one sentence, and leaves the file as it is.
TickFileRepair repairTickFile(const std::filesystem::path& file, std::uint64_t layout);

/// The header of a .npy file for that many rows of one type in NumPy's notation; empty: of ticks.
std::string npyHeader(const std::string& type, std::uint64_t rows);

/// Hash of the names and types of tickFields(): two programs with the same value write the same columns.
std::uint64_t tickLayout();

}  // namespace touchstone::sandbox
