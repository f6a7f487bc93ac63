// SPDX-License-Identifier: Apache-2.0
// The test program starts itself again under the emulator, once for each set of emulated devices.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "../cpp/support.hpp"

namespace {

struct Machine {
    const char* suite;
    std::vector<std::string> options;
};

/// Runs this program with the emulator and returns the exit code.
int run_under_emulator(const std::string& self, const Machine& machine, std::vector<std::string> words) {
    std::vector<std::string> command{PALPATE_USB_EMULATOR, "--lock-step"};
    command.insert(command.end(), machine.options.begin(), machine.options.end());
    if (const std::string first = PALPATE_PRELOAD_FIRST; !first.empty()) {
        command.insert(command.end(), {"--preload-first", first});
    }
    command.insert(command.end(), {"--", self});
    command.insert(command.end(), words.begin(), words.end());
    const pid_t child = ::fork();
    if (child == 0) {
        std::vector<char*> pointers;
        for (std::string& word : command) {
            pointers.push_back(word.data());
        }
        pointers.push_back(nullptr);
        ::execv(pointers[0], pointers.data());
        ::_exit(127);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

int main(int count, char** words) {
    const std::string self = std::filesystem::read_symlink("/proc/self/exe");
    std::vector<std::string> arguments(words + 1, words + count);
    std::string filter;
    bool lists = false;
    for (const std::string& word : arguments) {
        filter = word.rfind("--gtest_filter=", 0) == 0 ? word.substr(15) : filter;
        lists = lists || word == "--gtest_list_tests";
    }
    if (lists || std::getenv("PALPATE_EMULATOR") != nullptr) {
        testing::InitGoogleTest(&count, words);
        return RUN_ALL_TESTS();
    }
    std::vector<Machine> machines{{"UsbDevice", {}},
                                  {"UsbTwoDevices", {"--serial", "LEFT", "--serial", "RIGHT"}},
                                  {"UsbNoDevice", {"--no-device"}},
                                  {"UsbForeignDevice", {"--wrong-magic"}},
                                  {"UsbDeniedDevice", {"--denied"}},
                                  {"UsbPlainDevice", {"--no-transducer", "--no-velocity"}},
                                  {"UsbModelDevice", {"--model", "10"}},
                                  {"UsbDelay", {}},
                                  {"UsbEnding", {}},
                                  {"UsbText", {"--no-device"}}};
    for (int seed = 1; seed <= palpate::test::cases(5, 10); ++seed) {
        machines.push_back({"UsbOtherFirmware", {"--seed", std::to_string(seed)}});
    }
    int worst = 0;
    for (const Machine& machine : machines) {
        const std::string suite = machine.suite;
        if (filter.empty() || filter.rfind(suite + ".", 0) == 0) {
            std::vector<std::string> given = arguments;
            if (filter.empty()) {
                given.push_back("--gtest_filter=" + suite + ".*");
            }
            const int code = run_under_emulator(self, machine, given);
            if (code != 0) {
                std::cerr << "failed on the machine:";
                for (const std::string& option : machine.options) {
                    std::cerr << " " << option;
                }
                std::cerr << "\n";
            }
            worst = std::max(worst, code);
        }
    }
    return worst;
}
