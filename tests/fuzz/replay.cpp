// SPDX-License-Identifier: Apache-2.0
// Calls a fuzz target with each file of the folder of its seeds, in a build without libFuzzer: fuzz_replay FOLDER.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <vector>

#include "fuzzing.hpp"

int main(int count, char** words) {
    const std::filesystem::path folder{count == 2 ? words[1] : ""};
    const std::string name = folder.filename().string();
    const auto target = palpate::fuzz::targets().find(name);
    if (target == palpate::fuzz::targets().end()) {
        std::cerr << "Usage: " << words[0] << " FOLDER, which has the name of a target\n";
        return 2;
    }
    std::size_t inputs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        std::ifstream file{entry.path(), std::ios::binary};
        const std::vector<std::uint8_t> input{std::istreambuf_iterator<char>{file}, {}};
        std::cout << entry.path().filename().string()
                  << std::endl;  // the last name is that of an input that fails
        target->second(input.data(), input.size());
        ++inputs;
    }
    return inputs > 0 ? 0 : 1;
}
