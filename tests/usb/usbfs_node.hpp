// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <umockdev.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "port.hpp"
#include "usbfs_files.hpp"

namespace emulator {

/// Device in a umockdev testbed: its files, and the usbfs ioctls of its device file.
class UsbfsNode {
  public:
    UsbfsNode(UMockdevTestbed* testbed, EmulatedDevice device, int address, std::mutex& mutex)
        : handler_{umockdev_ioctl_base_new()}, port_{std::move(device)}, mutex_{mutex} {
        g_object_connect(handler_, "signal-after::handle-ioctl", G_CALLBACK(&UsbfsNode::ioctl_called), this,
                         nullptr);
        files_ = std::make_unique<UsbfsFiles>(testbed, handler_, port_.device().identity(), address);
    }
    UsbfsNode(const UsbfsNode&) = delete;
    UsbfsNode& operator=(const UsbfsNode&) = delete;

    // The caller of `port` to `frame` must hold the mutex.
    [[nodiscard]] Port& port() { return port_; }
    [[nodiscard]] const std::string& node_file() const { return files_->node_file(); }
    void frame() {
        port_.frame();
        show_readiness();
    }
    /// Removes the transfers of all clients.
    void remove_clients() {
        for (const auto& [client, is_connected] : clients_) {
            remove_client(client);
        }
    }
    /// Removes the transfers of clients that ended without closing the device.
    void remove_closed_clients() {
        for (auto& [client, is_connected] : clients_) {
            if (is_connected && umockdev_ioctl_client_get_connected(client) == FALSE) {
                remove_client(client);
            }
        }
    }

    /// The caller must not hold the mutex, because the umockdev testbed may execute an ioctl that waits for the mutex.
    void announce_removal() { files_->announce_removal(); }
    void announce_arrival() { files_->announce_arrival(); }

  private:
    void show_readiness() { files_->show(!port_.done().empty()); }

    static gboolean ioctl_called(UMockdevIoctlBase* /*handler*/, UMockdevIoctlClient* client,
                                 UsbfsNode* self) {
        const std::lock_guard locked{self->mutex_};
        const bool is_connected = self->notice(client);
        const int result =
            is_connected ? self->answer(client, umockdev_ioctl_client_get_request(client)) : -ENODEV;
        self->show_readiness();
        if (result == -ENOTTY) {
            return FALSE;
        }
        umockdev_ioctl_client_complete(client, result < 0 ? -1 : result, result < 0 ? -result : 0);
        return TRUE;
    }

    /// Keeps a reference to a new client, so that its end can be detected. Returns false if the client was removed: an
    /// ioctl of a killed client can arrive later, and its transfers would stay forever.
    bool notice(UMockdevIoctlClient* client) {
        const auto [place, is_new] = clients_.insert({client, true});
        if (is_new) {
            g_object_ref(client);
        }
        return place->second;
    }

    void remove_client(UMockdevIoctlClient* client) {
        clients_[client] = false;
        port_.remove_client(client);
        if (claimed_by_ == client) {
            reset_host();
        }
        // The memory of the transfers of this client was freed when the client process ended.
        std::erase_if(urbs_, [&](const auto& urb) { return urb.first.first == client; });
        show_readiness();
    }

    void reset_host() {
        claimed_by_ = nullptr;
        port_.reset_host();
    }

    /// Returns the argument of an ioctl, copied from the client; changes reach the client when the ioctl is completed.
    template <class Struct>
    static Struct* argument(UMockdevIoctlClient* client, UMockdevIoctlData*& data) {
        data = resolved(umockdev_ioctl_client_get_arg(client), 0, sizeof(Struct));
        return reinterpret_cast<Struct*>(data->data);
    }

    /// Exception for a client that ended during an ioctl.
    struct Gone {};

    /// Returns the target of a pointer in the client's memory.
    static UMockdevIoctlData* resolved(UMockdevIoctlData* data, std::size_t offset, std::size_t length) {
        UMockdevIoctlData* target = umockdev_ioctl_data_resolve(data, offset, length, nullptr);
        if (target == nullptr) {
            throw Gone{};
        }
        return target;
    }

    /// Executes an ioctl of a client; returns a result >= 0, or a negative errno.
    int answer(UMockdevIoctlClient* client, unsigned long request) {
        UMockdevIoctlData* data = nullptr;
        int result = -EFAULT;
        try {
            result = answer(client, request, data);
        } catch (const Gone&) {
            remove_client(client);
        }
        if (data != nullptr) {
            g_object_unref(data);
        }
        return result;
    }

    int answer(UMockdevIoctlClient* client, unsigned long request, UMockdevIoctlData*& data) {
        const bool gone = port_.device().is_unplugged();
        switch (request) {
            case USBDEVFS_REAPURB:
            case USBDEVFS_REAPURBNDELAY:
                return reap(client, data);
            case USBDEVFS_DISCARDURB:
                return discard(client);
            default:
                break;
        }
        if (gone) {
            return -ENODEV;
        }
        switch (request) {
            case USBDEVFS_GET_CAPABILITIES:
                *argument<std::uint32_t>(client, data) =
                    USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION |
                    USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
                return 0;
            case USBDEVFS_GET_SPEED:
                return 2;  // full
            case USBDEVFS_CLAIMINTERFACE:
            case USBDEVFS_DISCONNECT_CLAIM:
                if (*argument<unsigned>(client, data) != 0) {
                    return -ENOENT;
                }
                if (claimed_by_ != nullptr && claimed_by_ != client) {
                    return -EBUSY;
                }
                claimed_by_ = client;
                return 0;
            case USBDEVFS_RELEASEINTERFACE:
                if (claimed_by_ != client) {
                    return -EINVAL;
                }
                reset_host();
                return 0;
            case USBDEVFS_GETDRIVER:
            case USBDEVFS_IOCTL:
                return -ENODATA;
            case USBDEVFS_SETCONFIGURATION:
            case USBDEVFS_SETINTERFACE:
            case USBDEVFS_RESET:
                if (claimed_by_ != nullptr && claimed_by_ != client) {
                    return -EBUSY;
                }
                port_.device().disarm();
                return 0;
            case USBDEVFS_CLEAR_HALT:
                port_.clear_halt(static_cast<std::uint8_t>(*argument<unsigned>(client, data)));
                return 0;
            case USBDEVFS_SUBMITURB:
                return submit(client);
            default:
                return -ENOTTY;
        }
    }

    int submit(UMockdevIoctlClient* client) {
        UMockdevIoctlData* data = nullptr;
        const auto* urb = argument<usbdevfs_urb>(client, data);
        const auto address = static_cast<std::uint64_t>(data->client_addr);
        Transfer transfer;
        transfer.id = address;
        transfer.owner = client;
        transfer.is_control = urb->type == USBDEVFS_URB_TYPE_CONTROL;
        transfer.endpoint = urb->endpoint;
        const auto length = static_cast<std::size_t>(urb->buffer_length);
        Bytes bytes;
        if (length > 0) {
            UMockdevIoctlData* buffer = resolved(data, offsetof(usbdevfs_urb, buffer), length);
            bytes.assign(buffer->data, buffer->data + length);
            g_object_unref(buffer);
        }
        if (transfer.is_control) {
            if (length < 8) {
                g_object_unref(data);
                return -EINVAL;
            }
            if (claimed_by_ != nullptr && claimed_by_ != client && (bytes[0] & 0x1FU) == 1) {
                g_object_unref(data);
                return -EBUSY;
            }
            transfer.setup.assign(bytes.begin(), bytes.begin() + 8);
            bytes.erase(bytes.begin(), bytes.begin() + 8);
        }
        transfer.length = bytes.size();
        transfer.data = std::move(bytes);
        const int result = port_.submit(std::move(transfer));
        if (result < 0) {
            g_object_unref(data);
            return result;
        }
        urbs_[{client, address}] = data;
        return 0;
    }

    int reap(UMockdevIoctlClient* client, UMockdevIoctlData*& data) {
        std::deque<Transfer>& done = port_.done();
        const auto found = std::find_if(done.begin(), done.end(),
                                        [&](const Transfer& transfer) { return transfer.owner == client; });
        if (found == done.end()) {
            return port_.device().is_unplugged() ? -ENODEV : -EAGAIN;
        }
        const auto known = urbs_.find({client, found->id});
        UMockdevIoctlData* urb_data = known->second;
        urbs_.erase(known);
        auto* urb = reinterpret_cast<usbdevfs_urb*>(urb_data->data);
        urb->status = found->status;
        urb->actual_length = static_cast<int>(found->actual);
        const bool in =
            found->is_control ? (found->setup.at(0) & 0x80U) != 0 : (found->endpoint & 0x80U) != 0;
        if (in && found->actual > 0) {
            UMockdevIoctlData* buffer = resolved(urb_data, offsetof(usbdevfs_urb, buffer), 0);
            std::memcpy(buffer->data + (found->is_control ? 8 : 0), found->data.data(), found->actual);
            g_object_unref(buffer);
        }
        argument<void*>(client, data);
        umockdev_ioctl_data_set_ptr(data, 0, urb_data);
        g_object_unref(urb_data);
        done.erase(found);
        return 0;
    }

    int discard(UMockdevIoctlClient* client) {
        std::uint64_t address = 0;
        std::memcpy(&address, umockdev_ioctl_client_get_arg(client)->data, sizeof address);
        return port_.cancel(address, client, -ENOENT) ? 0 : -EINVAL;
    }

    UMockdevIoctlBase* handler_;
    Port port_;
    std::unique_ptr<UsbfsFiles> files_;
    std::mutex& mutex_;
    std::map<UMockdevIoctlClient*, bool> clients_;  ///< the value is true while the client process runs
    const UMockdevIoctlClient* claimed_by_ = nullptr;
    std::map<std::pair<const UMockdevIoctlClient*, std::uint64_t>, UMockdevIoctlData*>
        urbs_;  ///< by client, address
};

}  // namespace emulator
