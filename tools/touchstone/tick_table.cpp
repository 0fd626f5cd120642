#include "tools/touchstone/tick_table.hpp"

#include <charconv>
#include <stdexcept>
#include <string>

namespace touchstone::app {
namespace {

constexpr const char* kHeader =
    "tick,t_ms,"
    "device_x_mm,device_y_mm,device_z_mm,device_qw,device_qx,device_qy,device_qz,"
    "tool_x_mm,tool_y_mm,tool_z_mm,tool_qw,tool_qx,tool_qy,tool_qz,"
    "force_x_N,force_y_N,force_z_N,torque_x_mNm,torque_y_mNm,torque_z_mNm,"
    "force_out_x_N,force_out_y_N,force_out_z_N,torque_out_x_mNm,torque_out_y_mNm,torque_out_z_mNm,"
    "penetration_mm,hover_mm,margin_used_mm,projection_mm,"
    "pairs,rows,rows_truncated,rows_screened,screen_inexact,iterations,linearisations,status,flags,"
    "kkt_primal_mm,kkt_dual_N,kkt_stationarity_N,kkt_complementarity_mJ,"
    "shadow_rows,shadow_rows_cut,shadow_iterations,shadow_force_error_N,shadow_torque_error_mNm,"
    "collision_us,solve_us,shadow_us,step_us,helper_us\n";

/// Appends fields with commas between; numbers read back to the same bits.
class Line {
  public:
    template <class Number>
    Line& operator<<(Number number) {
        if (!text_.empty()) text_ += ',';
        char buffer[32];
        text_.append(buffer, std::to_chars(buffer, std::end(buffer), number).ptr);
        return *this;
    }
    Line& operator<<(const Vec3& v) { return *this << v.x() << v.y() << v.z(); }
    Line& operator<<(const Pose& X) { return *this << X.p << X.q.w() << X.q.x() << X.q.y() << X.q.z(); }
    Line& operator<<(const Wrench& w) { return *this << w.force << w.torque; }
    Line& operator<<(const char* name) {
        text_ += ',';
        text_ += name;
        return *this;
    }
    const std::string& text() const { return text_; }

  private:
    std::string text_;
};

}  // namespace

TickTable::TickTable(const std::filesystem::path& file) : file_(file), out_(file, std::ios::binary) {
    if (!out_)
        throw std::runtime_error("cannot write the ticks to '" + file.string() +
                                 "': check the folder and its permissions");
    out_ << kHeader;
}

void TickTable::add(const TickRecord& record, double penetration, double rate) {
    Line line;
    line << record.tick << static_cast<double>(record.tick) * 1000 / rate;
    line << record.X_WT_device << record.X_WT << record.wrench_C << record.wrench_out;
    line << penetration << record.hover << record.marginUsed << record.projection;
    line << record.pairs << record.rows << record.rowsTruncated << record.rowsScreened << record.screenInexact;
    line << record.iterations << record.linearisations;
    line << name(record.status) << record.flags;
    line << record.kkt.primal_mm << record.kkt.dual_N << record.kkt.stationarity_N << record.kkt.complementarity_mJ;
    line << record.shadowRows << record.shadowRowsCut << record.shadowIterations << record.shadowForceError
         << record.shadowTorqueError;
    line << record.collisionUs << record.solveUs << record.shadowUs << record.totalUs - record.shadowUs
         << record.helperUs;
    out_ << line.text() << '\n';
}

void TickTable::close() {
    out_.close();
    if (!out_) throw std::runtime_error("cannot write the ticks to '" + file_.string() + "': is the disk full?");
}

}  // namespace touchstone::app
