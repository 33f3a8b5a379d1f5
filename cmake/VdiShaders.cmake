# Compiles GLSL to SPIR-V at build time, checks it, and embeds it.

find_program(GLSLANG_VALIDATOR glslangValidator REQUIRED)
find_program(SPIRV_VAL spirv-val REQUIRED)

# vdi_embed_shaders(<target> <folder> [NAMESPACE <namespace>] SHADERS name ...): compiles
# <folder>/<name>.comp for Vulkan 1.3, runs spirv-val on the result, and adds a source to the target
# that defines
#   std::span<const std::uint32_t> <namespace>::shaderCode(std::string_view name)
# for those names. The default namespace is vdi::gpu. The build tracks includes: a changed header
# recompiles only the shaders that use it.
function(vdi_embed_shaders target folder)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "NAMESPACE" "SHADERS")
  set(namespace "${arg_NAMESPACE}")
  if(NOT namespace)
    set(namespace vdi::gpu)
  endif()
  set(outputDir "${CMAKE_CURRENT_BINARY_DIR}/shaders/${target}")
  file(MAKE_DIRECTORY "${outputDir}")
  set(table "")
  set(includes "")
  set(headers "")
  foreach(name IN LISTS arg_SHADERS)
    set(source "${folder}/${name}.comp")
    set(header "${outputDir}/${name}.spv.h")
    set(spirv "${outputDir}/${name}.spv")
    add_custom_command(
      OUTPUT "${spirv}"
      COMMAND ${GLSLANG_VALIDATOR} --quiet -V --target-env vulkan1.3 "-I${folder}" --depfile "${spirv}.d" -o "${spirv}"
              "${source}"
      COMMAND ${SPIRV_VAL} --target-env vulkan1.3 --scalar-block-layout "${spirv}"
      DEPENDS "${source}"
      DEPFILE "${spirv}.d"
      COMMENT "Shader ${name}.comp"
      VERBATIM)
    add_custom_command(
      OUTPUT "${header}"
      COMMAND ${CMAKE_COMMAND} "-DINPUT=${spirv}" "-DOUTPUT=${header}" "-DNAME=${name}" -P
              "${CMAKE_SOURCE_DIR}/cmake/EmbedSpirv.cmake"
      DEPENDS "${spirv}" "${CMAKE_SOURCE_DIR}/cmake/EmbedSpirv.cmake"
      VERBATIM)
    list(APPEND headers "${header}")
    string(APPEND includes "#include \"${name}.spv.h\"\n")
    string(APPEND table "      {\"${name}\", spirv_${name}},\n")
  endforeach()
  configure_file("${CMAKE_SOURCE_DIR}/cmake/ShaderCode.cpp.in" "${outputDir}/ShaderCode.cpp" @ONLY)
  target_sources(${target} PRIVATE "${outputDir}/ShaderCode.cpp" ${headers})
  target_include_directories(${target} PRIVATE "${outputDir}")
endfunction()
