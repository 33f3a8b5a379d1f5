# Compiles GLSL to SPIR-V at build time, checks it, and embeds it.

find_program(GLSLANG_VALIDATOR glslangValidator REQUIRED)
find_program(SPIRV_VAL spirv-val REQUIRED)
find_program(SPIRV_OPT spirv-opt REQUIRED)

# vdi_embed_shaders(<target> <folder> [NAMESPACE <namespace>] SHADERS name ... [PROGRAMS name count ...]): compiles
# <folder>/<name>.comp for Vulkan 1.3, runs spirv-val on the result, and adds a source to the target
# that defines
#   std::span<const std::uint32_t> <namespace>::shaderCode(std::string_view name)
# for those names. A shader of PROGRAMS is compiled once for each number from 0 to count - 1, with PROGRAM defined to it, as
# <name>_<number>, and again as <name>_<number>_pruned, without the code of the other programs. Mesa takes several times as
# long to remove that code; NVIDIA's driver makes slower code from a pruned shader, by 6 % in one program. The default
# namespace is vdi::gpu. The build tracks includes: a changed header recompiles only the shaders that use it.
function(vdi_embed_shaders target folder)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "NAMESPACE" "SHADERS;PROGRAMS")
  set(namespace "${arg_NAMESPACE}")
  if(NOT namespace)
    set(namespace vdi::gpu)
  endif()
  set(outputDir "${CMAKE_CURRENT_BINARY_DIR}/shaders/${target}")
  file(MAKE_DIRECTORY "${outputDir}")
  set(table "")
  set(includes "")
  set(headers "")
  set(programs "")
  while(arg_PROGRAMS)
    list(POP_FRONT arg_PROGRAMS name count)
    set(number 0)
    while(number LESS count)
      foreach(form "" _pruned)
        list(APPEND programs ${name}_${number}${form})
        set(program_of_${name}_${number}${form} ${name} ${number})
      endforeach()
      math(EXPR number "${number} + 1")
    endwhile()
  endwhile()
  foreach(name IN LISTS arg_SHADERS programs)
    set(source "${folder}/${name}.comp")
    set(header "${outputDir}/${name}.spv.h")
    set(spirv "${outputDir}/${name}.spv")
    set(definition "")
    set(removal "")
    if(name IN_LIST programs)
      list(GET program_of_${name} 0 shader)
      list(GET program_of_${name} 1 number)
      set(source "${folder}/${shader}.comp")
      set(definition "-DPROGRAM=${number}")
    endif()
    if(name MATCHES "_pruned$")
      # Passes that only remove code. Those that change it make modules that Mesa 22.3 doesn't compile, and Debian 12's
      # --eliminate-dead-code-aggressive crashes.
      set(removal COMMAND ${SPIRV_OPT} --target-env=vulkan1.3 --scalar-block-layout --eliminate-dead-branches
                  --eliminate-dead-functions "${spirv}" -o "${spirv}")
    endif()
    add_custom_command(
      OUTPUT "${spirv}"
      COMMAND ${GLSLANG_VALIDATOR} --quiet -V --target-env vulkan1.3 "-I${folder}" ${definition} --depfile "${spirv}.d" -o
              "${spirv}" "${source}" ${removal}
      COMMAND ${SPIRV_VAL} --target-env vulkan1.3 --scalar-block-layout "${spirv}"
      DEPENDS "${source}"
      DEPFILE "${spirv}.d"
      COMMENT "Shader ${name}"
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
