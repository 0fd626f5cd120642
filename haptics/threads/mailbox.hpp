#pragma once
// Hands ownership of an object from one thread to another.
#include <atomic>
#include <memory>

namespace touchstone {

/// Holds at most one object. Real time: wait-free; neither side allocates or frees, except the destructor.
template <class T>
class Mailbox {
  public:
    Mailbox() = default;
    Mailbox(const Mailbox&) = delete;
    Mailbox& operator=(const Mailbox&) = delete;
    ~Mailbox() { delete object_.load(std::memory_order_acquire); }

    /// Puts the object in and returns the one that was still there, which the caller frees.
    std::unique_ptr<T> put(std::unique_ptr<T> object) {
        return std::unique_ptr<T>(object_.exchange(object.release(), std::memory_order_acq_rel));
    }
    /// Takes the object out; null if there is none.
    std::unique_ptr<T> take() {
        // The plain read makes it cheap to test an empty mailbox in every tick.
        return empty() ? nullptr : std::unique_ptr<T>(object_.exchange(nullptr, std::memory_order_acq_rel));
    }
    bool empty() const { return object_.load(std::memory_order_relaxed) == nullptr; }

  private:
    std::atomic<T*> object_ = nullptr;
};

}  // namespace touchstone
