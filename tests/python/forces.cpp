// SPDX-License-Identifier: Apache-2.0
// The library as a C++ program has it: networks and positions from standard input, forces, slopes and energies to
// standard output, all as doubles.

#include <cstddef>
#include <cstdio>
#include <vector>

#include <palpate/palpate.hpp>

namespace {

std::vector<double> read(std::size_t count) {
    std::vector<double> values(count);
    values.resize(std::fread(values.data(), sizeof(double), count, stdin));
    return values;
}

palpate::Continuation continuation(double code) {
    return code == 0.0 ? palpate::Continuation::Linear : palpate::Continuation::Free;
}

}  // namespace

int main() {
    constexpr std::size_t numbers = 8;
    while (true) {
        const std::vector<double> head = read(numbers);
        if (head.size() < numbers) {
            return head.empty() ? 0 : 1;
        }
        const auto size = static_cast<std::size_t>(head[0]);
        const std::vector<double> alpha = read(size);
        const std::vector<double> beta = read(size);
        const std::vector<double> weight = read(size);
        const palpate::WaveletNetwork network{
            {1, alpha, beta, weight, {head[2]}, head[3]},
            {{head[4]}, {head[5]}, continuation(head[6]), continuation(head[7]), std::nullopt}};
        for (const double x : read(static_cast<std::size_t>(head[1]))) {
            const palpate::EnvironmentSample sample = network.at(x, {});
            const double answer[]{sample.force, sample.slope, sample.energy};
            std::fwrite(answer, sizeof(double), 3, stdout);
        }
    }
}
