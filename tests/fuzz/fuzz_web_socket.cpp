// SPDX-License-Identifier: Apache-2.0
// Bytes of a WebSocket server. Bytes in pieces give the same messages, pings and errors as in one piece; no message is
// longer than the bound, and after an error nothing else is found.
#include <string>
#include <utility>
#include <vector>

#include "fuzzing.hpp"
#include "palpate/device/web_socket.hpp"

namespace {

using palpate::WebSocketFrames;
using Found = WebSocketFrames::Found;
using Read = std::vector<std::pair<Found, std::string>>;

void read(WebSocketFrames& frames, std::string_view bytes, Read& all) {
    using palpate::fuzz::require;
    frames.add(bytes);
    std::string content;
    for (Found found = frames.next(content); found != Found::Nothing; found = frames.next(content)) {
        require(found == Found::Message || content.size() <= 125 || found == Found::Error,
                "a control frame is short");
        require(content.size() <= WebSocketFrames::max_message, "a message is not longer than the bound");
        if (found == Found::Error) {
            require(frames.next(content) == Found::Error, "an error stays");
            if (all.empty() || all.back().first != Found::Error) {
                all.emplace_back(found, "");
            }
            return;
        }
        all.emplace_back(found, content);
    }
}

}  // namespace

FUZZ_TARGET(web_socket) {
    palpate::fuzz::Input input{data, size};
    const std::size_t piece = 1 + input.take<std::uint8_t>() % 32;
    const std::string_view bytes = input.take_text();
    Read at_once;
    Read in_pieces;
    WebSocketFrames frames;
    read(frames, bytes, at_once);
    WebSocketFrames frames_in_pieces;
    for (std::size_t k = 0; k < bytes.size(); k += piece) {
        read(frames_in_pieces, bytes.substr(k, piece), in_pieces);
    }
    palpate::fuzz::require(at_once == in_pieces, "pieces give the same messages");
    return 0;
}
