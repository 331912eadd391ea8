/* Ids of job options, for errors and warnings of code that does not know the job document. Such code puts an id into
 * err->field or into a warning, and the pipeline replaces it by the key of the document (optimizer/job/option_key.h).
 * An element of a list has its index after the id: "photograph_file[3]".
 */
#ifndef SELVEDGE_BASE_OPTION_ID_H
#define SELVEDGE_BASE_OPTION_ID_H

#define OPTION_NONE ""
/* the scan */
#define OPTION_SCAN_FILES "scan_files"
#define OPTION_GEOMETRY_JOB "geometry_job"
#define OPTION_RAW "raw"
#define OPTION_RAW_SHAPE "raw_shape"
#define OPTION_RAW_TYPE "raw_type"
#define OPTION_RAW_HEADER "raw_header"
#define OPTION_VOXEL_SIZE "voxel_size"
#define OPTION_AXES "axes"
#define OPTION_MATRIX "matrix"
#define OPTION_CROP_BOX "crop_box"
#define OPTION_ALIGN "align"
#define OPTION_CROP "crop"
#define OPTION_DENSITY_LOW "density_low"
#define OPTION_DENSITY_HIGH "density_high"
#define OPTION_FIBER_DIAMETER "fiber_diameter"
#define OPTION_HOLLOW_FIBERS "hollow_fibers"
#define OPTION_FILTER_S "filter_s"
#define OPTION_FILTER_T "filter_t"
#define OPTION_FILTER_LENGTH "filter_length"
#define OPTION_FILTER_DENSITY "filter_density"
#define OPTION_FILTER_ANSWER "filter_answer"
#define OPTION_LINK_REACH "link_reach"
#define OPTION_LEAST_VERTICES "least_vertices"
/* the fiber file */
#define OPTION_FIBER_FILE "fiber_file"
#define OPTION_TILE "tile"
#define OPTION_DENSITY_VOXEL "density_voxel"
#define OPTION_GROUPS "groups"
/* the described cloth */
#define OPTION_YARNS "yarns"
#define OPTION_CLOTH "described_cloth"
#define OPTION_CORRECTION "correction"
#define OPTION_CLOTH_TEXTURE "cloth_texture"
#define OPTION_TEXTURE_PX_PER_MM "texture_px_per_mm"
/* the set-up */
#define OPTION_ENVIRONMENT_FILE "environment_file"
#define OPTION_MESH_FILE "mesh_file"
#define OPTION_RIG "rig_file"
#define OPTION_PHOTOGRAPH_VIEW "photograph_view"
#define OPTION_CAMERA_NOISE "camera_noise"
#define OPTION_DARK_FRAMES "dark_frames"
#define OPTION_COLOR_CHART "color_chart"
#define OPTION_COLOR_WHITE "color_white"
/* the measurements */
#define OPTION_MEASUREMENT_FILE "measurement_file"
#define OPTION_MEASURED_ROWS "measured_rows"
#define OPTION_PROFILE_FILE "profile_file"
#define OPTION_PHOTOGRAPHS "photographs"
#define OPTION_PHOTOGRAPH_FILE "photograph_file"
/* the fit */
#define OPTION_MODEL "model"
#define OPTION_METHOD "method"
#define OPTION_PATH_BUDGET "path_budget"
#define OPTION_PLAIN_PRIOR "plain_prior"
#define OPTION_PRECISION "precision"
#define OPTION_DISCREPANCY "discrepancy"
#define OPTION_START "start"
#define OPTION_STARTS "starts"
#define OPTION_PRIORS "priors"
#define OPTION_PROFILE_JOB "profile_job"
#define OPTION_NUISANCE "nuisance"
#define OPTION_TEXTURE_BLOCK "texture_block"
#define OPTION_FIT_RADIUS "fit_radius"
#define OPTION_FIT_RADIUS_UPPER "fit_radius_upper"

#endif
