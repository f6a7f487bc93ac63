// SPDX-License-Identifier: Apache-2.0
// Calls a fuzz target with each file of a folder, in a build without libFuzzer: fuzz_TARGET FOLDER.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int main(int count, char** words) {
    if (count != 2) {
        std::cerr << "Usage: " << words[0] << " FOLDER\n";
        return 2;
    }
    std::size_t inputs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(words[1])) {
        std::ifstream file{entry.path(), std::ios::binary};
        const std::vector<std::uint8_t> input{std::istreambuf_iterator<char>{file}, {}};
        std::cout << entry.path().filename().string()
                  << std::endl;  // the last name is that of an input that fails
        LLVMFuzzerTestOneInput(input.data(), input.size());
        ++inputs;
    }
    return inputs > 0 ? 0 : 1;
}
