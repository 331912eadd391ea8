/* What the dashboard uses of others, for the checker of `make lint-javascript`. */
declare const Dygraph: any;
declare module "*/three.module.js";
