// Swagger UI on this service's own OpenAPI document. Nothing is validated or fetched elsewhere; a call that changes something
// carries the token that the guard asks for.
window.SwaggerUIBundle({
  url: "/openapi.json",
  dom_id: "#rest-calls",
  deepLinking: true,
  docExpansion: "list",
  defaultModelsExpandDepth: -1,
  validatorUrl: null,
  supportedSubmitMethods: ["get", "post", "put", "patch", "delete"],
  requestInterceptor: (request) => {
    request.headers["X-CSRF-Token"] = document.querySelector('meta[name="csrf-token"]').content;
    return request;
  },
});
