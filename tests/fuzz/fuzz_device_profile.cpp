// SPDX-License-Identifier: Apache-2.0
// A device profile is read or refused with one sentence. An accepted profile has a delay of at most 16 periods, also
// with the model on its motor controller, and is the same after it was written.
#include <stdexcept>
#include <string_view>

#include "fuzzing.hpp"
#include "palpate/device/device_profile.hpp"
#include "palpate/io/json_field.hpp"
#include "palpate/io/json_text.hpp"

namespace {

void check_delay(const palpate::DeviceProfile& profile) {
    using palpate::fuzz::require;
    require(profile.late_samples() >= 0 && profile.late_samples() <= palpate::longest_delay_samples,
            "the delay is 0 to 16 samples");
    require(profile.delay_fraction() >= 0.0 && profile.delay_fraction() < 1.0,
            "the rest of the delay is less than a period");
    require(profile.longest_period_s() >= profile.period_s, "jitter makes a period longer");
}

palpate::DeviceProfile profile_of(std::string_view text) {
    const palpate::Json content = palpate::parse_json(text);
    const auto profile = palpate::detail::JsonField{content, ""}.as<palpate::DeviceProfile>();
    palpate::validate(profile);
    return profile;
}

}  // namespace

FUZZ_TARGET(device_profile) {
    using palpate::fuzz::require;
    palpate::fuzz::Input input{data, size};
    try {
        const auto rate_hz = input.take<double>();
        const std::string_view text = input.take_text();
        const palpate::DeviceProfile profile = profile_of(text);
        check_delay(profile);
        require(profile_of(palpate::parse_json(text).dump()) == profile,
                "a profile is the same after it was written");
        check_delay(palpate::on_device(profile, rate_hz));
    } catch (const std::invalid_argument& error) {
        require(std::string_view{error.what()}.find('\n') == std::string_view::npos,
                "a profile is refused with one sentence");
    }
    return 0;
}
