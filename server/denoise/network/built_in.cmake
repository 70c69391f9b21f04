# Writes the source that makes every network/weights/*.tza a part of the program, so that the project's own networks
# need no files where it runs.
function(relume_built_in_networks target)
    file(GLOB files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/network/weights/*.tza)
    set(data "")
    set(symbols "")
    set(entries "")
    foreach(file IN LISTS files)
        get_filename_component(name ${file} NAME_WE)
        string(MAKE_C_IDENTIFIER ${name} id)
        string(APPEND data "asm(\".pushsection .rodata\\n.balign 64\\nrelume_network_${id}:\\n.incbin \\\"${file}\\\"\\n\"\n"
            "    \"relume_network_${id}_end:\\n.popsection\\n\");\n")
        string(APPEND symbols "extern const std::byte relume_network_${id}[], relume_network_${id}_end[];\n")
        string(APPEND entries "    {\"${name}\", {relume_network_${id}, relume_network_${id}_end}},\n")
    endforeach()
    set(source ${CMAKE_CURRENT_BINARY_DIR}/built_in_networks.cpp)
    file(CONFIGURE OUTPUT ${source} @ONLY CONTENT [=[
#include <vector>

#include "server/denoise/network/built_in.h"

@data@
extern "C" {
@symbols@}

namespace relume::denoise {

std::span<const BuiltInNetwork> BuiltInNetworks() {
    static const std::vector<BuiltInNetwork> networks = {
@entries@    };
    return networks;
}

}  // namespace relume::denoise
]=])
    set_property(SOURCE ${source} PROPERTY OBJECT_DEPENDS "${files}")
    target_sources(${target} PRIVATE ${source})
endfunction()
