#include "haptics/sandbox/record/tick_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "haptics/math/hash.hpp"

namespace touchstone::sandbox {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic("\x93NUMPY\x01\x00", 8);
constexpr std::size_t kPreamble = kMagic.size() + 2, kCountDigits = 20, kReadRows = 1024;

/// The .npy header for that many ticks. Its length does not depend on the number.
std::string headerFor(std::uint64_t rows) { return npyHeader({}, rows); }

std::uint64_t headerBytes() {
    static const std::uint64_t bytes = headerFor(0).size();
    return bytes;
}

std::size_t sizeOfType(std::string_view type) {
    std::size_t size = 0;
    const bool known = type.size() == 3 && std::string_view("<|").find(type[0]) != std::string_view::npos &&
                       std::string_view("fiub").find(type[1]) != std::string_view::npos;
    if (known) size = static_cast<std::size_t>(type[2] - '0');
    return size == 1 || size == 2 || size == 4 || size == 8 ? size : 0;
}

std::string readAt(int handle, std::uint64_t at, std::size_t size) {
    std::string bytes(size, '\0');
    std::size_t got = 0;
    while (got < size) {
        const ssize_t n = pread(handle, bytes.data() + got, size - got, static_cast<off_t>(at + got));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        got += static_cast<std::size_t>(n);
    }
    bytes.resize(got);
    return bytes;
}

struct Column {
    std::string name, type;
};

/// The name of today for a column of an earlier version.
std::string_view columnName(std::string_view name) {
    if (name == "linearisations") return "linearizations";
    return name == "helper_us" ? "list_worker_us" : name;
}

struct Header {
    std::vector<Column> columns;
    std::uint64_t rows = 0, bytes = 0;
    std::size_t rowBytes = 0;
};

/// The Python literal that NumPy and headerFor() write. Throws std::invalid_argument with what is wrong.
class HeaderParser {
  public:
    explicit HeaderParser(std::string_view text) : text_(text) {}

    Header parse() {
        Header header;
        bool shape = false;
        expect('{');
        while (!accept('}')) {
            const std::string key = word();
            expect(':');
            if (key == "descr")
                header.columns = columns();
            else if (key == "fortran_order")
                literal("False");
            else if (key == "shape")
                header.rows = count(), shape = true;
            else
                throw std::invalid_argument("its header has an unknown key");
            accept(',');
        }
        if (header.columns.empty() || !shape) throw std::invalid_argument("its header lacks columns or shape");
        for (const Column& column : header.columns) {
            const std::size_t size = sizeOfType(column.type);
            if (size == 0) throw std::invalid_argument("a column has a type that recordings do not have");
            header.rowBytes += size;
        }
        return header;
    }

  private:
    void skip() {
        while (!text_.empty() && (text_.front() == ' ' || text_.front() == '\n')) text_.remove_prefix(1);
    }
    bool accept(char c) {
        skip();
        if (text_.empty() || text_.front() != c) return false;
        text_.remove_prefix(1);
        return true;
    }
    void expect(char c) {
        if (!accept(c)) throw std::invalid_argument("its header is broken");
    }
    void literal(std::string_view what) {
        skip();
        if (text_.substr(0, what.size()) != what)
            throw std::invalid_argument("it is not an array of rows stored one after another");
        text_.remove_prefix(what.size());
    }
    std::string word() {
        expect('\'');
        const auto end = text_.find('\'');
        if (end == std::string_view::npos) throw std::invalid_argument("its header is broken");
        std::string found(text_.substr(0, end));
        text_.remove_prefix(end + 1);
        return found;
    }
    std::uint64_t count() {
        expect('(');
        skip();
        std::uint64_t rows = 0;
        const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), rows);
        if (error != std::errc()) throw std::invalid_argument("its header has no number of rows");
        text_.remove_prefix(static_cast<std::size_t>(end - text_.data()));
        expect(',');
        expect(')');
        return rows;
    }
    std::vector<Column> columns() {
        std::vector<Column> all;
        expect('[');
        while (!accept(']')) {
            expect('(');
            Column column;
            column.name = word();
            expect(',');
            column.type = word();
            expect(')');
            accept(',');
            all.push_back(std::move(column));
        }
        return all;
    }

    std::string_view text_;
};

/// Throws std::invalid_argument with what is wrong.
Header readHeader(int handle) {
    const std::string begin = readAt(handle, 0, kPreamble);
    if (begin.size() < kPreamble || begin.substr(0, kMagic.size()) != kMagic)
        throw std::invalid_argument("it is no NumPy file of version 1");
    const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(begin[i])); };
    const std::size_t length = byte(kMagic.size()) + 256 * byte(kMagic.size() + 1);
    const std::string text = readAt(handle, kPreamble, length);
    if (text.size() < length) throw std::invalid_argument("its header is cut off");
    Header header = HeaderParser(text).parse();
    header.bytes = kPreamble + length;
    return header;
}

std::uint64_t sizeOf(int handle) {
    struct stat status {};
    return fstat(handle, &status) == 0 ? static_cast<std::uint64_t>(status.st_size) : 0;
}

/// Whether these are the first bytes of a header of ticks, but for the number of rows and for bytes that a crash left
/// zero. Another program's file is not.
bool isWhatACrashLeaves(std::string_view begin) {
    const std::string header = headerFor(0);
    const std::size_t same = header.find("'shape'");
    for (std::size_t i = 0; i < std::min(begin.size(), header.size()); ++i) {
        const bool known =
            i < same ? begin[i] == header[i]
                     : std::string_view("'shape': (0123456789,) }\n").find(begin[i]) != std::string_view::npos;
        if (!known && begin[i] != '\0') return false;
    }
    return true;
}

std::string reason() { return std::generic_category().message(errno); }

/// Sets a field from the bytes of its column. False if the bytes are not a valid value of its type.
bool setField(const TickField& field, RecordedTick& tick, const char* bytes) {
    return std::visit(
        [&](auto* value) {
            using Value = std::remove_pointer_t<decltype(value)>;
            if constexpr (std::is_same_v<Value, bool> || std::is_same_v<Value, SolveStatus>) {
                const auto number = static_cast<unsigned char>(*bytes);
                if (number > (std::is_same_v<Value, bool> ? 1 : static_cast<int>(SolveStatus::Invalid))) return false;
                *value = static_cast<Value>(number);
            } else {
                std::memcpy(value, bytes, sizeof *value);
            }
            return true;
        },
        field.of(tick));
}

}  // namespace

std::string npyHeader(const std::string& type, std::uint64_t rows) {
    std::string text = "{'descr': " + (type.empty() ? "[" : "'" + type + "'");
    if (type.empty()) {
        for (const TickField& field : tickFields())
            text += "('" + std::string(field.name) + "', '" + field.type() + "'), ";
        text += "]";
    }
    text += ", 'fortran_order': False, 'shape': (";
    std::string count = std::to_string(rows);
    const std::size_t spare = kCountDigits - count.size();
    text += count + ",), }" + std::string(spare, ' ');
    text.append(63 - (kPreamble + text.size()) % 64, ' ');  // NumPy wants the data aligned to 64
    text += '\n';
    std::string header(kMagic);
    header += static_cast<char>(text.size() & 0xff);
    header += static_cast<char>(text.size() >> 8);
    return header + text;
}

std::uint64_t tickLayout() {
    const std::string header = headerFor(0);
    return Hash().add(header.data(), header.size()).value();
}

FileHandle::~FileHandle() {
    if (descriptor_ >= 0) close(descriptor_);
}

RandomAccessFile::RandomAccessFile(fs::path file, bool existing)
    : file_(std::move(file)), handle_(open(file_.c_str(), O_WRONLY | O_CLOEXEC | (existing ? 0 : O_CREAT), 0666)) {
    if (handle_ < 0) fail("open");
}

void RandomAccessFile::fail(const char* what) const {
    throw std::runtime_error(std::string("cannot ") + what + " '" + file_.string() + "': " + reason());
}

void RandomAccessFile::write(const std::string& bytes, std::uint64_t at) {
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t n = pwrite(handle_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) fail("write");
        done += static_cast<std::size_t>(n);
    }
}

std::uint64_t RandomAccessFile::size() const { return sizeOf(handle_); }

void RandomAccessFile::cut(std::uint64_t size) {
    if (ftruncate(handle_, static_cast<off_t>(size)) != 0) fail("shorten");
}

TickFileWriter::TickFileWriter(const fs::path& file) : file_(file) { file_.write(headerFor(0), 0); }

void TickFileWriter::append(const RecordedTick& tick) {
    buffer_.resize(buffer_.size() + tickRowBytes());
    packTick(tick, buffer_.data() + buffer_.size() - tickRowBytes());
}

void TickFileWriter::flush() {
    if (buffer_.empty()) return;
    try {
        file_.write(buffer_, headerBytes() + written_ * tickRowBytes());
    } catch (const std::exception&) {
        // A full disk took only some of the rows. The complete ones count; overwriting the header needs no more space.
        buffer_.resize((file_.size() - headerBytes()) / tickRowBytes() * tickRowBytes() - written_ * tickRowBytes());
        countRows();
        file_.cut(headerBytes() + written_ * tickRowBytes());
        throw;
    }
    countRows();
}

void TickFileWriter::countRows() {
    file_.write(headerFor(rows()), 0);
    written_ = rows();
    buffer_.clear();
}

TickFileReader::TickFileReader(fs::path file)
    : file_(std::move(file)), handle_(open(file_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
    if (handle_ < 0) fail(reason());
    try {
        const Header header = readHeader(handle_);
        dataBegin_ = header.bytes;
        rows_ = header.rows;
        rowBytes_ = header.rowBytes;
        std::size_t offset = 0;
        for (const Column& column : header.columns) {
            for (const TickField& field : tickFields())
                if (field.name == columnName(column.name)) {
                    if (field.type() != column.type)
                        throw std::invalid_argument("a column has another type than in this program");
                    columns_.push_back({&field, offset});
                }
            offset += sizeOfType(column.type);
        }
    } catch (const std::invalid_argument& wrong) {
        fail(wrong.what());
    }
    for (const TickField& field : tickFields()) {
        const bool present = std::any_of(columns_.begin(), columns_.end(), [&](auto& c) { return c.field == &field; });
        if (present)
            fields_.push_back(&field);
        else if (std::string_view(field.name).starts_with("input_"))
            fail("it lacks the column " + std::string(field.name));
    }
    const std::uint64_t complete = (std::max(sizeOf(handle_), dataBegin_) - dataBegin_) / rowBytes_;
    if (rows_ > complete)
        fail("its header counts " + std::to_string(rows_) + " rows, but it has " + std::to_string(complete) +
             ": 'touchstone recover' repairs it");
}

void TickFileReader::fail(const std::string& what) const {
    throw std::runtime_error("cannot read the ticks '" + file_.string() + "': " + what);
}

bool TickFileReader::next(RecordedTick& tick) {
    if (row_ == rows_) return false;
    if (bufferRow_ * rowBytes_ == buffer_.size()) {
        const std::uint64_t rows = std::min<std::uint64_t>(kReadRows, rows_ - row_);
        buffer_ = readAt(handle_, dataBegin_ + row_ * rowBytes_, rows * rowBytes_);
        bufferRow_ = 0;
        if (buffer_.size() != rows * rowBytes_) fail("it ends before its last row");
    }
    const char* bytes = buffer_.data() + bufferRow_ * rowBytes_;
    for (const auto& [field, offset] : columns_)
        if (!setField(*field, tick, bytes + offset))
            fail("row " + std::to_string(row_) + " has no valid value in " + field->name);
    ++bufferRow_;
    ++row_;
    return true;
}

TickFileRepair repairTickFile(const fs::path& file, std::uint64_t layout) {
    const auto fail = [&](const std::string& what) {
        return std::runtime_error("cannot recover the ticks '" + file.string() + "': " + what);
    };
    const FileHandle handle(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (handle < 0) throw fail(reason());
    TickFileRepair repair;
    Header header;
    const std::uint64_t size = sizeOf(handle);
    std::string wrong;
    try {
        header = readHeader(handle);
    } catch (const std::invalid_argument& broken) {
        wrong = broken.what();
    }
    if (!wrong.empty()) {
        if (layout != tickLayout()) throw fail(wrong + ", and its columns differ from this program's");
        if (!isWhatACrashLeaves(readAt(handle, 0, headerBytes())))
            throw fail(wrong + ", and it is not what a crash leaves of ticks: it stays as it is, move it away");
        header.bytes = headerBytes();
        header.rowBytes = tickRowBytes();
    } else if (header.bytes != headerBytes() || header.rowBytes != tickRowBytes() || layout != tickLayout()) {
        throw fail("its columns differ from this program's: use the program that wrote it");
    }
    const std::uint64_t data = std::max(size, header.bytes) - header.bytes;
    repair = {header.rows, data / header.rowBytes, data % header.rowBytes};
    RandomAccessFile out(file, true);
    out.write(headerFor(repair.rows), 0);
    out.cut(header.bytes + repair.rows * header.rowBytes);
    return repair;
}

}  // namespace touchstone::sandbox
