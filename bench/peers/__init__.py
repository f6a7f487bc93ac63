# SPDX-License-Identifier: Apache-2.0
"""What a user would pick instead, tuned as a competent user would; what is not installed is left out."""
