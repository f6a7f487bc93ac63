// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "port.hpp"

namespace emulator {

/// A device in a umockdev testbed: what stands in /sys, and a node in /dev/bus/usb that answers the usbfs ioctls of
/// libusb.
///
/// umockdev passes on ioctls but no poll(). The node is therefore a FIFO with room for one byte: full, and so not
/// writable, while there is nothing to reap, and empty when there is. libusb waits for just that.
class UsbfsNode {
  public:
    UsbfsNode(UMockdevTestbed* testbed, EmulatedDevice device, int address, std::mutex& mutex,
              std::function<void()> woken)
        : testbed_{testbed},
          port_{std::move(device)},
          address_{address},
          mutex_{mutex},
          woken_{std::move(woken)} {
        handler_ = umockdev_ioctl_base_new();
        g_object_connect(handler_, "signal-after::handle-ioctl", G_CALLBACK(&UsbfsNode::ioctl_called), this,
                         nullptr);
        const std::string number = std::to_string(100 + address_).substr(1);
        name_ = "1-" + std::to_string(address_);
        system_path_ = "/sys/devices/usb1/" + name_;
        node_ = "/dev/bus/usb/001/0" + number;
        GError* error = nullptr;
        if (umockdev_testbed_attach_ioctl(testbed_, node_.c_str(), handler_, &error) == FALSE) {
            throw std::runtime_error(std::string("umockdev: ") + error->message);
        }
        if (umockdev_testbed_add_from_string(testbed_, description().c_str(), &error) == FALSE) {
            throw std::runtime_error(std::string("umockdev: ") + error->message);
        }
        make_fifo();
    }
    ~UsbfsNode() {
        umockdev_testbed_detach_ioctl(testbed_, node_.c_str(), nullptr);
        for (const UMockdevIoctlClient* client : clients_) {
            auto* const object = const_cast<UMockdevIoctlClient*>(client);
            g_object_weak_unref(G_OBJECT(object), &UsbfsNode::client_left, this);
        }
        g_object_unref(handler_);
        ::close(fifo_);
    }
    UsbfsNode(const UsbfsNode&) = delete;
    UsbfsNode& operator=(const UsbfsNode&) = delete;

    // All of these under the mutex.
    [[nodiscard]] Port& port() { return port_; }
    [[nodiscard]] FrameClock& clock() { return *clock_; }
    void set_clock(FrameClock& clock) { clock_ = &clock; }
    [[nodiscard]] const std::string& node_file() const { return node_file_; }
    void frame() {
        port_.frame();
        show_readiness();
    }

    /// Not under the mutex: the testbed may be answering an ioctl that waits for it.
    void tell_removal() {
        umockdev_testbed_uevent(testbed_, system_path_.c_str(), "remove");
        umockdev_testbed_remove_device(testbed_, system_path_.c_str());
    }
    void tell_arrival() { umockdev_testbed_uevent(testbed_, system_path_.c_str(), "add"); }

  private:
    /// The device and the root hub that it hangs on, as umockdev reads them.
    [[nodiscard]] std::string description() const {
        const auto hex = [](const Bytes& bytes) {
            constexpr const char* digits = "0123456789abcdef";
            std::string text;
            for (const std::uint8_t byte : bytes) {
                text += digits[byte >> 4U];
                text += digits[byte & 15U];
            }
            return text;
        };
        Bytes descriptors = Identity::device_descriptor();
        const Bytes configuration = Identity::configuration_descriptor();
        descriptors.insert(descriptors.end(), configuration.begin(), configuration.end());
        const Identity& identity = port_.device().identity();
        const std::string address = std::to_string(address_);
        return "P: /devices/usb1/" + name_ + "\nN: " + node_.substr(5) +
               "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: DRIVER=usb\nE: BUSNUM=001\nE: DEVNUM=0" +
               node_.substr(node_.size() - 2) + "\nE: DEVNAME=" + node_ +
               "\nE: PRODUCT=1209/1/100\nE: TYPE=255/0/0\nA: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: "
               "devnum=" +
               address + "\\n\nA: speed=12\\n\nA: idVendor=1209\\n\nA: idProduct=0001\\n\nA: serial=" +
               identity.serial + "\\n\nA: product=" + identity.product +
               "\\n\nA: manufacturer=" + identity.manufacturer + "\\n\nH: descriptors=" + hex(descriptors) +
               "\n\n";
    }

    void make_fifo() {
        gchar* root = umockdev_testbed_get_root_dir(testbed_);
        node_file_ = std::string(root) + node_;
        g_free(root);
        ::unlink(node_file_.c_str());
        if (::mkfifo(node_file_.c_str(), 0666) != 0) {
            throw std::runtime_error("no FIFO at " + node_file_);
        }
        ::chmod(node_file_.c_str(), 0666);
        fifo_ = ::open(node_file_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
        ::fcntl(fifo_, F_SETPIPE_SZ, 4096);
        show_readiness();
    }

    void show_readiness() {
        const bool ready = !port_.done().empty();
        if (ready == shown_ready_) {
            return;
        }
        shown_ready_ = ready;
        char byte = 0;
        const ssize_t moved = ready ? ::read(fifo_, &byte, 1) : ::write(fifo_, &byte, 1);
        if (moved != 1) {
            throw std::runtime_error("the FIFO of the device node does not do as it should");
        }
    }

    static gboolean ioctl_called(UMockdevIoctlBase* /*handler*/, UMockdevIoctlClient* client,
                                 UsbfsNode* self) {
        const std::lock_guard locked{self->mutex_};
        self->notice(client);
        const int result = self->answer(client, umockdev_ioctl_client_get_request(client));
        self->show_readiness();
        if (result == -ENOTTY) {
            return FALSE;
        }
        umockdev_ioctl_client_complete(client, result < 0 ? -1 : result, result < 0 ? -result : 0);
        return TRUE;
    }

    /// A client that is seen for the first time: its end takes its transfers along.
    void notice(UMockdevIoctlClient* client) {
        if (clients_.insert(client).second) {
            g_object_weak_ref(G_OBJECT(client), &UsbfsNode::client_left, this);
        }
    }
    /// Only its address is left of it.
    static void client_left(gpointer node, GObject* object) {
        auto* const self = static_cast<UsbfsNode*>(node);
        const auto* const client = reinterpret_cast<const UMockdevIoctlClient*>(object);
        const std::lock_guard locked{self->mutex_};
        self->clients_.erase(client);
        self->port_.forget(client);
        if (self->claimed_by_ == client) {
            self->let_go();
        }
        for (auto urb = self->urbs_.begin(); urb != self->urbs_.end();) {
            if (urb->first.first == client) {
                g_object_unref(urb->second);
                urb = self->urbs_.erase(urb);
            } else {
                ++urb;
            }
        }
        self->show_readiness();
    }

    void let_go() {
        claimed_by_ = nullptr;
        port_.let_go();
        clock_->host_left();
    }

    /// The argument of an ioctl, copied from the client; changes reach the client when the ioctl is completed.
    template <class Struct>
    static Struct* argument(UMockdevIoctlClient* client, UMockdevIoctlData*& data) {
        UMockdevIoctlData* pointer = umockdev_ioctl_client_get_arg(client);
        data = umockdev_ioctl_data_resolve(pointer, 0, sizeof(Struct), nullptr);
        return data == nullptr ? nullptr : reinterpret_cast<Struct*>(data->data);
    }

    /// A result >= 0, or a negative errno.
    int answer(UMockdevIoctlClient* client, unsigned long request) {
        UMockdevIoctlData* data = nullptr;
        int result = answer(client, request, data);
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
                let_go();
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
            UMockdevIoctlData* buffer =
                umockdev_ioctl_data_resolve(data, offsetof(usbdevfs_urb, buffer), length, nullptr);
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
        const bool writes = transfer.endpoint == 0x01 && !transfer.is_control;
        const int result = port_.submit(std::move(transfer));
        if (result < 0) {
            g_object_unref(data);
            return result;
        }
        urbs_[{client, address}] = data;
        if (writes) {
            clock_->host_wrote();
        }
        woken_();
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
            UMockdevIoctlData* buffer =
                umockdev_ioctl_data_resolve(urb_data, offsetof(usbdevfs_urb, buffer), 0, nullptr);
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

    UMockdevTestbed* testbed_;
    UMockdevIoctlBase* handler_ = nullptr;
    Port port_;
    FrameClock* clock_ = nullptr;
    int address_;
    std::string name_;
    std::string system_path_;
    std::string node_;
    std::string node_file_;
    int fifo_ = -1;
    bool shown_ready_ = true;  ///< an empty FIFO
    std::mutex& mutex_;
    std::function<void()> woken_;
    std::set<const UMockdevIoctlClient*> clients_;
    const UMockdevIoctlClient* claimed_by_ = nullptr;
    std::map<std::pair<const UMockdevIoctlClient*, std::uint64_t>, UMockdevIoctlData*>
        urbs_;  ///< by client, address
};

}  // namespace emulator
