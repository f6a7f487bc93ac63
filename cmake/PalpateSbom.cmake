# SPDX-License-Identifier: Apache-2.0
# Lists the libraries that are compiled into the Python module and palpate-control, with their versions, in the wheel:
# palpate-VERSION.dist-info/sboms/palpate.cdx.json (CycloneDX 1.6, PEP 770). A shared library such as libusb is in a
# wheel only after auditwheel has copied it; auditwheel then adds its own list.

include_guard()

set(palpate_components "")

# palpate_component(NAME VERSION LICENCE PURL): VERSION is empty if the library was not found; PURL ends before it.
function(palpate_component name version licence purl)
  if(version)
    string(CONFIGURE [[
    {
      "type": "library",
      "bom-ref": "@name@",
      "name": "@name@",
      "version": "@version@",
      "licenses": [{ "license": { "id": "@licence@" } }],
      "purl": "@purl@@version@"
    }]] component @ONLY)
    list(APPEND palpate_components "${component}")
    set(palpate_components "${palpate_components}" PARENT_SCOPE)
  endif()
endfunction()

palpate_component(pybind11 "${pybind11_VERSION}" BSD-3-Clause "pkg:pypi/pybind11@")
palpate_component(nlohmann-json "${nlohmann_json_VERSION}" MIT "pkg:github/nlohmann/json@v")
if(PALPATE_BUILD_CONTROL)
  palpate_component(CLI11 "${CLI11_VERSION}" BSD-3-Clause "pkg:github/CLIUtils/CLI11@v")
endif()
list(JOIN palpate_components ",\n" palpate_components)
file(
  CONFIGURE
  OUTPUT "${PROJECT_BINARY_DIR}/palpate.cdx.json"
  CONTENT [==[
{
  "bomFormat": "CycloneDX",
  "specVersion": "1.6",
  "version": 1,
  "metadata": {
    "component": {
      "type": "library",
      "bom-ref": "palpate",
      "name": "palpate",
      "version": "@PROJECT_VERSION@",
      "licenses": [{ "license": { "id": "Apache-2.0" } }],
      "purl": "pkg:pypi/palpate@@PROJECT_VERSION@"
    }
  },
  "components": [
@palpate_components@
  ]
}
]==] @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/palpate.cdx.json" DESTINATION "${SKBUILD_METADATA_DIR}/sboms" COMPONENT python)
