# SPDX-License-Identifier: Apache-2.0
"""Model classes, and which of them earns its place."""
