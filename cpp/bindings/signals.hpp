// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>

#include <pybind11/pybind11.h>

namespace palpate::bindings {

/// Lets Ctrl-C interrupt long work that runs without the lock of the Python interpreter. The work calls it once for
/// each step. At most ten times a second it runs Python's signal handlers and calls `progress(step)`; an exception of
/// them ends the work.
class Interruptible {
  public:
    explicit Interruptible(const pybind11::function* progress = nullptr) : progress_{progress} {}

    void operator()(std::size_t step) {
        if (const auto now = std::chrono::steady_clock::now(); now >= due_) {
            due_ = now + std::chrono::milliseconds{100};
            const pybind11::gil_scoped_acquire locked;
            if (PyErr_CheckSignals() != 0) {
                throw pybind11::error_already_set();
            }
            if (progress_ != nullptr) {
                (*progress_)(step);
            }
        }
    }

  private:
    const pybind11::function* progress_;
    std::chrono::steady_clock::time_point due_;
};

}  // namespace palpate::bindings
